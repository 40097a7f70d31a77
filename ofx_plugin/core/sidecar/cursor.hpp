// A value of a sidecar's JSON tree and its place. What does not fit ends in a SidecarError that
// names the place, what was found and what was expected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "model/polytope.hpp"
#include "model/sidecar_error.hpp"
#include "sidecar/json_tree.hpp"

namespace palette4d {

/// A number as JSON has it.
std::string number_text(double number);

/// The JSON pointer is only built for an error. Types and ranges of values are those of the schema,
/// which check() (schema.hpp) has compared.
class Cursor {
public:
    Cursor(const Json& root, const std::string& file) : value_(&root), file_(&file) {}

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const;
    [[noreturn]] void wrong(const std::string& expected) const;
    /// Throws a problem whose pointer begins here.
    [[noreturn]] void fail_inside(const SidecarError& problem) const;
    /// Refuses `count` things where more than `most` are one too many.
    void limit(std::size_t count, std::size_t most, const std::string& of) const;

    const Json& json() const { return *value_; }
    /// The name of this member; "elements" for an element of a list.
    std::string name() const { return name_ ? name_ : "elements"; }
    bool has(const char* name) const { return value_->contains(name); }
    /// The required member `name`.
    Cursor member(const char* name) const;
    /// The same where its value is known.
    Cursor member(const char* name, const Json& value) const;
    Cursor element(std::size_t index) const;
    std::size_t size() const { return value_->size(); }

    std::string text() const { return value_->get<std::string>(); }
    /// Whether it is this text.
    bool is(const char* text) const { return *value_ == text; }
    std::int64_t integer() const { return static_cast<std::int64_t>(number()); }
    double number() const { return value_->get<double>(); }
    /// A number later than the `previous` one, which it becomes.
    double later(std::optional<double>& previous) const;
    Vec3 three() const { return value_->get<Vec3>(); }

private:
    std::string pointer() const;

    const Json* value_;
    const std::string* file_;
    const Cursor* parent_ = nullptr;
    const char* name_ = nullptr;
    std::size_t index_ = 0;
};

}  // namespace palette4d
