#include "sidecar/cursor.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "model/sidecar_error.hpp"
#include "sidecar/json_tree.hpp"

namespace palette4d {
namespace {

constexpr std::size_t kMaxIdLength = 64;
constexpr std::size_t kMaxNameLength = 100;

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

bool Cursor::has(const char* name) const { return value_->contains(name); }

Cursor Cursor::member(const char* name) const {
    const auto found = value_->find(name);
    if (found == value_->end()) {
        throw SidecarError(*file_, pointer() + pointer_token(name), "nothing",
                           "the member " + in_quotes(name));
    }
    Cursor child(*found, *file_);
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

void Cursor::require_object() const {
    if (!value_->is_object()) wrong("an object");
}

void Cursor::require_members(std::initializer_list<const char*> names,
                             std::initializer_list<const char*> optional) const {
    require_object();
    for (const auto& [name, unused] : value_->items()) {
        bool known = false;
        for (const auto& some : {names, optional}) {
            for (const char* candidate : some) known = known || name == candidate;
        }
        if (!known) {
            std::string list;
            for (const auto& some : {names, optional}) {
                for (const char* candidate : some) {
                    list += (list.empty() ? "" : ", ") + std::string(candidate);
                }
            }
            throw SidecarError(*file_, pointer() + pointer_token(name),
                               "the unknown member " + in_quotes(name), "only " + list);
        }
    }
    for (const char* name : names) member(name);
}

std::vector<std::string> Cursor::names(const char* of, std::size_t most) const {
    require_object();
    if (value_->size() > most) {
        fail(std::to_string(value_->size()) + " " + of,
             "at most " + std::to_string(most) + " " + of);
    }
    std::vector<std::string> found;
    for (const auto& [name, unused] : value_->items()) found.push_back(name);
    return found;
}

void Cursor::require_scalars() const {
    require_object();
    for (const auto& [name, value] : value_->items()) {
        if (value.is_structured()) {
            throw SidecarError(*file_, pointer() + pointer_token(name), described(value),
                               "a number, a text, true, false or null");
        }
    }
}

std::size_t Cursor::list(const char* of) const {
    if (!value_->is_array()) wrong(std::string("a list of ") + of);
    return value_->size();
}

std::size_t Cursor::list(const char* of, std::size_t most, std::size_t others) const {
    const std::size_t count = list(of);
    if (count + others > most) {
        fail(std::to_string(count + others) + " " + of,
             "at most " + std::to_string(most) + " " + of);
    }
    return count;
}

std::string Cursor::text() const {
    if (!value_->is_string()) wrong("a text");
    return value_->get<std::string>();
}

std::size_t Cursor::choice(std::initializer_list<const char*> texts) const {
    std::size_t at = 0;
    std::string list;
    for (const char* text : texts) {
        if (value_->is_string() && *value_ == text) return at;
        ++at;
        list += (list.empty() ? "" : at == texts.size() ? " or " : ", ") + in_quotes(text);
    }
    wrong(list);
}

bool Cursor::flag() const {
    if (!value_->is_boolean()) wrong("true or false");
    return value_->get<bool>();
}

std::string Cursor::name() const {
    const std::string rule = "a name of 1 to " + std::to_string(kMaxNameLength) +
                             " characters, none of them a control character";
    if (!value_->is_string()) wrong(rule);
    const auto& name = value_->get_ref<const std::string&>();
    std::size_t length = 0;
    for (const char c : name) {
        if ((c >= 0 && c < 0x20) || c == 0x7f) wrong(rule);
        length += (static_cast<unsigned char>(c) & 0xc0) != 0x80;  // UTF-8: not a tail
    }
    if (length == 0 || length > kMaxNameLength) wrong(rule);
    return name;
}

std::string Cursor::id() const {
    const char* const rule =
        "an id: 1 to 64 letters, digits, '_', '-' or '.', a letter or a digit first";
    if (!value_->is_string()) wrong(rule);
    const auto& id = value_->get_ref<const std::string&>();
    bool valid = !id.empty() && id.size() <= kMaxIdLength;
    for (std::size_t i = 0; valid && i < id.size(); ++i) {
        const char c = id[i];
        const bool word =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        valid = word || (i > 0 && (c == '_' || c == '-' || c == '.'));
    }
    if (!valid) wrong(rule);
    return id;
}

std::int64_t Cursor::integer(std::int64_t lowest, std::int64_t highest) const {
    const std::string expected =
        "an integer from " + std::to_string(lowest) + " to " + std::to_string(highest);
    // As in JSON Schema, 24.0 and 2.4e1 are the integer 24. All bounds here are exact in double.
    const double number = value_->is_number() ? value_->get<double>() : 0.5;
    if (std::trunc(number) != number || number < static_cast<double>(lowest) ||
        number > static_cast<double>(highest)) {
        wrong(expected);
    }
    return static_cast<std::int64_t>(number);
}

double Cursor::number(double limit, const char* what) const {
    const bool fits = value_->is_number() && std::fabs(value_->get<double>()) <= limit;
    if (!fits) wrong(std::string(what) + " within +-" + number_text(limit));
    return value_->get<double>();
}

double Cursor::number(double lowest, double highest) const {
    const double found = value_->is_number() ? value_->get<double>() : lowest - 1;
    if (!(found >= lowest && found <= highest)) {
        wrong("a number from " + number_text(lowest) + " to " + number_text(highest));
    }
    return found;
}

double Cursor::later_frame(std::optional<double>& previous) const {
    const double number = frame();
    if (previous && !(number > *previous)) wrong("frames in increasing order, each once");
    previous = number;
    return number;
}

Vec3 Cursor::rgb() const {
    if (!value_->is_array() || value_->size() != 3) wrong("a list of 3 numbers, r, g and b");
    Vec3 colour{};
    for (std::size_t i = 0; i < 3; ++i) colour[i] = element(i).number(kMaxColour, "a number");
    return colour;
}

std::string Cursor::pointer() const {
    if (parent_ == nullptr) return "";
    return parent_->pointer() + (name_ ? pointer_token(name_) : '/' + std::to_string(index_));
}

}  // namespace palette4d
