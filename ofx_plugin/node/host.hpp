// The host's suites, with calls that are safe where a host lacks or refuses them.
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "ofx.hpp"

namespace palette4d::node {

/// The suites from Load. Optional suites are null where the host has none.
struct Suites {
    OfxPropertySetHandle host = nullptr;
    const OfxPropertySuiteV1* property = nullptr;
    const OfxParameterSuiteV1* parameter = nullptr;
    const OfxImageEffectSuiteV1* effect = nullptr;
    const OfxMultiThreadSuiteV1* thread = nullptr;  ///< optional
    const OfxMessageSuiteV1* message = nullptr;     ///< optional
    const OfxMessageSuiteV2* message2 = nullptr;    ///< optional
    const OfxProgressSuiteV1* progress = nullptr;   ///< optional
    /// Detected by a property of Natron's own, because the user can change the host's name.
    bool is_natron = false;
};

/// Remembers the host (OfxSetHost and OfxPlugin::setHost; a null host is ignored).
void set_host(const OfxHost* host);
/// Fetches the suites; false when there is no host or a required suite is missing. May be called
/// again while other threads render: they keep their suites.
bool load_suites();
/// The suites of the last successful Load; null before it. Valid for the life of the host.
std::shared_ptr<const Suites> suites();

/// A property set, read through the host's suite. Where the host lacks or refuses a property or
/// function, getters are empty and setters return false. Strings are copied at once: the host's own
/// are valid only until the next suite call.
class Properties {
public:
    Properties(const Suites& suites, OfxPropertySetHandle handle)
        : suite_(suites.property), handle_(handle) {}
    explicit operator bool() const { return suite_ && handle_; }
    OfxPropertySetHandle handle() const { return handle_; }

    std::optional<int> get_int(const char* name, int index = 0) const;
    std::optional<double> get_double(const char* name, int index = 0) const;
    std::optional<std::string> get_string(const char* name, int index = 0) const;
    std::optional<void*> get_pointer(const char* name, int index = 0) const;
    std::optional<OfxRectI> get_rect(const char* name) const;

    bool set_int(const char* name, int value, int index = 0) const;
    bool set_double(const char* name, double value, int index = 0) const;
    bool set_string(const char* name, const char* value, int index = 0) const;
    bool set_pointer(const char* name, void* value, int index = 0) const;
    /// Sets a property of several values; the values after a refused one move up.
    void set_strings(const char* name, std::initializer_list<const char*> values) const;
    /// The same for numbers whose index matters: stops at the first that is refused.
    void set_doubles(const char* name, std::initializer_list<double> values) const;

private:
    const OfxPropertySuiteV1* suite_;
    OfxPropertySetHandle handle_;
};

}  // namespace palette4d::node
