// The sidecar writer: a JSON tree becomes text. Equal trees give equal text.
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "sidecar/codec.hpp"
#include "sidecar/schema.hpp"

namespace palette4d {
namespace {

constexpr double kExact = 9007199254740992.0;  ///< 2^53

/// The fewest digits that read back to the same double, with a point or an exponent.
std::string real_text(double number) {
    char buffer[40];
    char* end = std::to_chars(buffer, buffer + 40, number, std::chars_format::scientific).ptr;
    const std::string text(buffer, end);
    const int exponent = std::atoi(text.c_str() + text.find('e') + 1);
    if (exponent < -4 || exponent >= 16) return text;
    end = std::to_chars(buffer, buffer + 40, number, std::chars_format::fixed).ptr;
    std::string fixed(buffer, end);
    return fixed.find('.') == std::string::npos ? fixed + ".0" : fixed;
}

class Writer {
public:
    std::string take() { return std::move(text_); }

    /// Writes a value on one line, or with `rows` its elements on a line each, `depth` steps in.
    void put(const Json& value, const Schema* schema, bool rows, int depth, bool real = false) {
        if (value.is_object()) {
            put_elements(in_order(value, schema), "{}", rows, depth, false);
        } else if (value.is_array()) {
            std::vector<Element> elements;
            const Schema* items = schema ? schema->items.get() : nullptr;
            for (const Json& item : value) elements.push_back({nullptr, &item, items});
            put_elements(elements, "[]", rows, depth, schema && schema->real);
        } else if (value.is_binary()) {
            text_ += digits_of(value);
        } else {
            put_plain(value, schema && schema->whole, real);
        }
    }

private:
    struct Element {
        const std::string* name;  ///< null in a list
        const Json* value;
        const Schema* schema;
    };

    static std::vector<Element> in_order(const Json& object, const Schema* schema) {
        std::vector<Element> elements;
        if (schema) {
            for (const auto& [name, member] : schema->members) {
                const auto at = object.find(name);
                if (at != object.end()) elements.push_back({&at.key(), &*at, member.get()});
            }
        }
        const std::size_t known = elements.size();
        const Schema* const others = schema ? schema->others.get() : nullptr;
        for (const auto& [name, value] : object.get_ref<const Json::object_t&>()) {
            bool there = false;
            for (std::size_t i = 0; i < known; ++i) there = there || elements[i].value == &value;
            if (!there) elements.push_back({&name, &value, others});
        }
        return elements;
    }

    void put_elements(const std::vector<Element>& elements, const char* brackets, bool rows,
                      int depth, bool real) {
        text_ += brackets[0];
        const auto line = [&](int steps) { text_.append(1, '\n').append(2 * steps, ' '); };
        rows = rows && !elements.empty();
        for (std::size_t i = 0; i < elements.size(); ++i) {
            if (i > 0) text_ += rows ? "," : ", ";
            if (rows) line(depth + 1);
            if (elements[i].name) text_ += Json(*elements[i].name).dump() + ": ";
            const Schema* const schema = elements[i].schema;
            put(*elements[i].value, schema, rows && schema && schema->rows, depth + 1, real);
        }
        if (rows) line(depth);
        text_ += brackets[1];
    }

    void put_plain(const Json& value, bool whole, bool real) {
        const double number = value.is_number() ? value.get<double>() : 0.5;
        const bool exact = std::fabs(number) <= kExact && std::trunc(number) == number;
        if (value.is_number_float() && exact && whole) {
            text_ += std::to_string(static_cast<std::int64_t>(number));
        } else if (value.is_number_float() || (exact && real)) {
            text_ += real_text(number);
        } else {
            text_ += value.dump();
        }
    }

    std::string text_;
};

}  // namespace

std::string sidecar_text(const Json& members, const std::string& name) {
    Writer writer;
    writer.put(members, &sidecar_schema(), true, 0);
    std::string text = writer.take() + "\n";
    require_size(text, name);
    return text;
}

}  // namespace palette4d
