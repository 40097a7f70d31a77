// The host's suites, and calls that survive a host which lacks or refuses any of them.
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "ofx.hpp"

namespace palette4d::node {

/// What the host handed out at Load. Optional suites are null where the host has none.
struct Suites {
    OfxPropertySetHandle host = nullptr;
    const OfxPropertySuiteV1* property = nullptr;
    const OfxParameterSuiteV1* parameter = nullptr;
    const OfxImageEffectSuiteV1* effect = nullptr;
    const OfxMultiThreadSuiteV1* thread = nullptr;  ///< optional
    const OfxMessageSuiteV1* message = nullptr;     ///< optional
    const OfxMessageSuiteV2* message2 = nullptr;    ///< optional
    /// Natron, which says so by a property of its own; its name is a preference of the user.
    bool is_natron = false;
};

/// Remembers the host (OfxSetHost and OfxPlugin::setHost; a null host is ignored).
void set_host(const OfxHost* host);
/// Fetches the suites; false when there is no host or one without the required suites. May be
/// called again at any time, also while other threads render: they keep what they hold.
bool load_suites();
/// The suites of the last successful Load; null before it. Valid for the life of the host.
std::shared_ptr<const Suites> suites();

/// A property set seen through a host's suite. Every getter is empty, and every setter false, when
/// the host has no such property, refuses it or lacks the function. Strings are copied at once:
/// the host's own live only until the next suite call.
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
    /// Sets a property of several values. One that is refused is left out, not left open.
    void set_strings(const char* name, std::initializer_list<const char*> values) const;
    /// The same for numbers whose place counts: nothing is set after one that is refused.
    void set_doubles(const char* name, std::initializer_list<double> values) const;

private:
    const OfxPropertySuiteV1* suite_;
    OfxPropertySetHandle handle_;
};

}  // namespace palette4d::node
