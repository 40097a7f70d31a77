// A plug-in that keeps the standard, but for one breach at a time: what the strict host's own tests
// tell its checks by.
#pragma once

#include <functional>
#include <initializer_list>
#include <set>
#include <string>
#include <vector>

#include "strict_host.hpp"

namespace guest {

/// What a breach may get hold of.
struct Now {
    OfxImageEffectHandle effect = nullptr;
    OfxParamSetHandle params = nullptr;
    OfxPropertySetHandle properties = nullptr;  ///< the effect's
    OfxPropertySetHandle source = nullptr, output = nullptr;
    OfxPropertySetHandle answer = nullptr;  ///< the action's
    unsigned char* source_pixels = nullptr;
    unsigned char* output_pixels = nullptr;
};
using Breach = std::function<void(Now&)>;

/// The plug-in's state, of which there is one.
struct Guest {
    OfxHost* host = nullptr;
    const OfxPropertySuiteV1* prop = nullptr;
    const OfxParameterSuiteV1* param = nullptr;
    const OfxImageEffectSuiteV1* effect = nullptr;
    const OfxMultiThreadSuiteV1* thread = nullptr;
    const OfxMessageSuiteV1* message = nullptr;
    std::string action;  ///< in which the breach happens
    Breach breach;
    std::set<std::string> left_out;  ///< of the description
    std::string slave;               ///< a parameter that the clip preferences depend on
    OfxStatus answer = kOfxStatOK;   ///< of a render
    int renders = 0;
};
extern Guest g;

template <typename Suite>
const Suite* fetch(const char* name, int version = 1) {
    return static_cast<const Suite*>(g.host->fetchSuite(g.host->host, name, version));
}

// What a breach is made of, as the plug-in itself does it.
void put(OfxPropertySetHandle set, const char* name, const char* text, int index = 0);
OfxPropertySetHandle define(Now& now, const char* type, const char* name);
OfxPropertySetHandle number(Now& now, const char* name, double initial = 1);
OfxPropertySetHandle choice(Now& now, const char* name, std::initializer_list<const char*> options,
                            int initial = 0);
OfxPropertySetHandle text(Now& now, const char* name);
OfxParamHandle handle_of(Now& now, const char* name);
OfxImageClipHandle clip_of(Now& now, const char* name);

/// The faults of the plug-in's life, in which the breach happens in one action. What is `left_out`
/// are properties and clips of its description; `answer` is that to a render.
std::vector<std::string> faults_of(const std::string& action, Breach breach,
                                   std::set<std::string> left_out = {},
                                   OfxStatus answer = kOfxStatOK);

}  // namespace guest
