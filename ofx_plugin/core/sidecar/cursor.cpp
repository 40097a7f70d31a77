#include "sidecar/cursor.hpp"

#include <cmath>

namespace palette4d {
namespace {

/// Describes a value for the "found" part of an error.
std::string described(const Json& value) {
    switch (value.type()) {
        case Json::value_t::null:
            return "null";
        case Json::value_t::boolean:
            return value.get<bool>() ? "true" : "false";
        case Json::value_t::string:
            return "the text " + in_quotes(value.get_ref<const std::string&>());
        case Json::value_t::array:
            return "a list of " + std::to_string(value.size());
        case Json::value_t::object:
            return "an object";
        case Json::value_t::binary:
            return "the number " + printable(digits_of(value), 40);
        case Json::value_t::number_float:
            return "the number " + number_text(value.get<double>());
        default:
            return "the number " + value.dump();
    }
}

}  // namespace

std::string number_text(double number) {
    if (std::isfinite(number)) return Json(number).dump();
    return std::isnan(number) ? "NaN" : number < 0 ? "-infinity" : "infinity";
}

void Cursor::fail(const std::string& found, const std::string& expected) const {
    throw SidecarError(*file_, pointer(), found, expected);
}

void Cursor::wrong(const std::string& expected) const { fail(described(*value_), expected); }

void Cursor::fail_inside(const SidecarError& problem) const {
    throw SidecarError(*file_, pointer() + problem.pointer(), problem.found(), problem.expected());
}

void Cursor::limit(std::size_t count, std::size_t most, const std::string& of) const {
    if (count <= most) return;
    fail(std::to_string(count) + ' ' + of, "at most " + std::to_string(most) + ' ' + of);
}

Cursor Cursor::member(const char* name) const {
    const auto found = value_->find(name);
    if (found == value_->end()) {
        throw SidecarError(*file_, pointer() + pointer_token(name), "nothing",
                           "the member " + in_quotes(name));
    }
    return member(name, *found);
}

Cursor Cursor::member(const char* name, const Json& value) const {
    Cursor child(value, *file_);
    child.parent_ = this;
    child.name_ = name;
    return child;
}

Cursor Cursor::element(std::size_t index) const {
    Cursor child((*value_)[index], *file_);
    child.parent_ = this;
    child.index_ = index;
    return child;
}

double Cursor::later(std::optional<double>& previous) const {
    if (previous && !(number() > *previous)) wrong("frames in increasing order, each once");
    return *(previous = number());
}

std::string Cursor::pointer() const {
    if (parent_ == nullptr) return "";
    return parent_->pointer() + (name_ ? pointer_token(name_) : '/' + std::to_string(index_));
}

}  // namespace palette4d
