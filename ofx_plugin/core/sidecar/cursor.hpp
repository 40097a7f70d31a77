// Reads the values of a sidecar's JSON tree. What does not fit ends in a SidecarError that names
// the place, what was found and what was expected.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "model/polytope.hpp"
#include "sidecar/json_tree.hpp"

namespace palette4d {

/// Limits for colours and frame numbers, so that geometry never overflows.
constexpr double kMaxColour = 1e6;
constexpr std::int64_t kMaxFrame = 1'000'000'000;
constexpr std::int64_t kMaxSize = 1'000'000;

/// A number as JSON has it.
std::string number_text(double number);

/// A value and its path. The JSON pointer is only built for an error.
class Cursor {
public:
    Cursor(const Json& root, const std::string& file) : value_(&root), file_(&file) {}

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const;
    [[noreturn]] void wrong(const std::string& expected) const;

    bool has(const char* name) const;
    /// The required member `name`.
    Cursor member(const char* name) const;
    Cursor element(std::size_t index) const;

    void require_object() const;
    /// Requires an object with exactly the members `names`; those in `optional` may be missing.
    void require_members(std::initializer_list<const char*> names,
                         std::initializer_list<const char*> optional = {}) const;
    /// The names of an object's members, at most `most`.
    std::vector<std::string> names(const char* of, std::size_t most) const;
    /// Requires an object with any names, whose values are numbers, texts, true, false or null.
    void require_scalars() const;

    /// The number of elements of a list.
    std::size_t list(const char* of) const;
    /// The same of a list that with the `others` may have at most `most` elements.
    std::size_t list(const char* of, std::size_t most, std::size_t others = 0) const;
    std::string text() const;
    /// One of a few texts; its position among them.
    std::size_t choice(std::initializer_list<const char*> texts) const;
    bool flag() const;
    /// What a user calls something.
    std::string name() const;
    std::string id() const;
    std::int64_t integer(std::int64_t lowest, std::int64_t highest) const;
    /// Within +-limit.
    double number(double limit, const char* what) const;
    double number(double lowest, double highest) const;
    double frame() const { return number(static_cast<double>(kMaxFrame), "a frame number"); }
    /// A frame later than the `previous` one, which it becomes.
    double later_frame(std::optional<double>& previous) const;
    Vec3 rgb() const;

private:
    std::string pointer() const;

    const Json* value_;
    const std::string* file_;
    const Cursor* parent_ = nullptr;
    const char* name_ = nullptr;
    std::size_t index_ = 0;
};

}  // namespace palette4d
