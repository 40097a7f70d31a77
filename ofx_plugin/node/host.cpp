#include "host.hpp"

#include <atomic>

namespace palette4d::node {
namespace {

std::atomic<const OfxHost*> g_host{nullptr};
// Every action reads it and Load replaces it; use std::atomic_load/store only.
std::shared_ptr<const Suites> g_suites;

template <typename Suite>
const Suite* fetch(const OfxHost& host, const char* name, int version) {
    return static_cast<const Suite*>(host.fetchSuite(host.host, name, version));
}

}  // namespace

void set_host(const OfxHost* host) {
    if (host) g_host.store(host);
}

bool load_suites() {
    const OfxHost* host = g_host.load();
    if (!host || !host->fetchSuite) return false;
    auto found = std::make_shared<Suites>();
    found->host = host->host;
    found->property = fetch<OfxPropertySuiteV1>(*host, kOfxPropertySuite, 1);
    found->parameter = fetch<OfxParameterSuiteV1>(*host, kOfxParameterSuite, 1);
    found->effect = fetch<OfxImageEffectSuiteV1>(*host, kOfxImageEffectSuite, 1);
    found->thread = fetch<OfxMultiThreadSuiteV1>(*host, kOfxMultiThreadSuite, 1);
    found->message2 = fetch<OfxMessageSuiteV2>(*host, kOfxMessageSuite, 2);
    found->message = fetch<OfxMessageSuiteV1>(*host, kOfxMessageSuite, 1);
    found->progress = fetch<OfxProgressSuiteV1>(*host, kOfxProgressSuite, 1);
    if (!found->property || !found->parameter || !found->effect) return false;
    found->is_natron = Properties(*found, found->host).get_int("NatronOfxHostIsNatron") == 1;
    std::atomic_store(&g_suites, std::shared_ptr<const Suites>(std::move(found)));
    return true;
}

std::shared_ptr<const Suites> suites() { return std::atomic_load(&g_suites); }

std::optional<int> Properties::get_int(const char* name, int index) const {
    int value = 0;
    if (!*this || !suite_->propGetInt ||
        suite_->propGetInt(handle_, name, index, &value) != kOfxStatOK) {
        return std::nullopt;
    }
    return value;
}

std::optional<double> Properties::get_double(const char* name, int index) const {
    double value = 0;
    if (!*this || !suite_->propGetDouble ||
        suite_->propGetDouble(handle_, name, index, &value) != kOfxStatOK) {
        return std::nullopt;
    }
    return value;
}

std::optional<std::string> Properties::get_string(const char* name, int index) const {
    char* value = nullptr;
    if (!*this || !suite_->propGetString ||
        suite_->propGetString(handle_, name, index, &value) != kOfxStatOK || !value) {
        return std::nullopt;
    }
    return std::string(value);
}

std::optional<void*> Properties::get_pointer(const char* name, int index) const {
    void* value = nullptr;
    if (!*this || !suite_->propGetPointer ||
        suite_->propGetPointer(handle_, name, index, &value) != kOfxStatOK) {
        return std::nullopt;
    }
    return value;
}

std::optional<OfxRectI> Properties::get_rect(const char* name) const {
    const auto x1 = get_int(name, 0), y1 = get_int(name, 1);
    const auto x2 = get_int(name, 2), y2 = get_int(name, 3);
    if (!x1 || !y1 || !x2 || !y2) return std::nullopt;
    return OfxRectI{*x1, *y1, *x2, *y2};
}

bool Properties::set_int(const char* name, int value, int index) const {
    return *this && suite_->propSetInt &&
           suite_->propSetInt(handle_, name, index, value) == kOfxStatOK;
}

bool Properties::set_double(const char* name, double value, int index) const {
    return *this && suite_->propSetDouble &&
           suite_->propSetDouble(handle_, name, index, value) == kOfxStatOK;
}

bool Properties::set_string(const char* name, const char* value, int index) const {
    return *this && suite_->propSetString &&
           suite_->propSetString(handle_, name, index, value) == kOfxStatOK;
}

bool Properties::set_pointer(const char* name, void* value, int index) const {
    return *this && suite_->propSetPointer &&
           suite_->propSetPointer(handle_, name, index, value) == kOfxStatOK;
}

void Properties::set_strings(const char* name, std::initializer_list<const char*> values) const {
    int index = 0;
    for (const char* value : values) index += set_string(name, value, index);
}

void Properties::set_doubles(const char* name, std::initializer_list<double> values) const {
    int index = 0;
    for (const double value : values) {
        if (!set_double(name, value, index++)) return;
    }
}

}  // namespace palette4d::node
