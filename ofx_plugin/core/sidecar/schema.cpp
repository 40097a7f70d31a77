#include "sidecar/schema.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/sidecar_error.hpp"

namespace palette4d {

extern const char* const kSidecarSchema;  // from CMake

namespace {

/// Nothing in the schema refers to itself.
Schema::Shared schema_of(const Json& node, const Json& root) {
    const auto result = std::make_shared<Schema>();
    if (node.contains("$ref")) {
        const Json::json_pointer at(node["$ref"].get<std::string>().substr(1));
        *result = *schema_of(root.at(at), root);
    }
    const auto type = node.find("type");
    if (type != node.end()) result->kind = type->is_string() ? type->get<std::string>() : "scalar";
    if (node.contains("format")) result->kind = node["format"];
    if (node.contains("const")) result->choices = {node["const"]};
    if (node.contains("enum")) result->choices = node["enum"].get<std::vector<Json>>();
    if (!result->choices.empty()) result->kind = "enum";
    for (const char* const name : {"minimum", "exclusiveMinimum"}) {
        result->lowest = node.value(name, result->lowest);
    }
    result->highest = node.value("maximum", result->highest);
    result->fewest = node.value("minItems", result->fewest);
    for (const char* const name : {"maxItems", "maxProperties", "maxLength"}) {
        result->most = node.value(name, result->most);
    }
    result->of = node.value("of", result->of);
    result->required = node.value("required", result->required);
    result->former = node.value("former", result->former);
    result->named_by_ids = result->named_by_ids || node.contains("propertyNames");
    const std::string write = node.value("write", "");
    result->rows = result->rows || write == "rows";
    result->real = result->real || write == "real";
    result->whole = result->whole || write == "whole" || result->kind == "integer";
    if (node.contains("properties")) {
        for (const auto& [name, member] : node["properties"].items()) {
            result->members.emplace_back(name, schema_of(member, root));
        }
    }
    const auto part = [&](const char* name) {
        const bool there = node.contains(name) && node[name].is_object();
        return there ? schema_of(node[name], root) : nullptr;
    };
    if (Schema::Shared others = part("additionalProperties")) result->others = others;
    result->closed = result->closed || node.value("additionalProperties", Json()) == Json(false);
    if (Schema::Shared items = part("items")) result->items = items;
    if (node.contains("prefixItems")) {
        // All elements of these lists are written in one form.
        for (const Json& item : node["prefixItems"]) {
            result->variants.push_back(schema_of(item, root));
        }
        result->items = result->variants.front();
        result->most = result->variants.size();
    }
    if (node.contains("anyOf")) {
        result->kind = "anyOf";
        for (const Json& some : node["anyOf"]) result->variants.push_back(schema_of(some, root));
    }
    return result;
}

const char* const kId =
    "an id: 1 to 64 letters, digits, '_', '-' or '.', a letter or a digit first";
constexpr std::size_t kMaxIdLength = 64;
constexpr std::size_t kMaxNameLength = 100;

bool is_id(const std::string& text) {
    const auto is_word = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    };
    return !text.empty() && text.size() <= kMaxIdLength && is_word(text[0]) &&
           std::all_of(text.begin(), text.end(),
                       [&](char c) { return is_word(c) || c == '_' || c == '-' || c == '.'; });
}

/// What a user calls something.
bool is_name(const std::string& text) {
    std::size_t length = 0;
    for (const char c : text) {
        if ((c >= 0 && c < 0x20) || c == 0x7f) return false;
        length += (static_cast<unsigned char>(c) & 0xc0) != 0x80;  // UTF-8: not a tail
    }
    return length > 0 && length <= kMaxNameLength;
}

std::string listed(const std::vector<std::string>& parts, const char* last) {
    std::string text;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        text += (i == 0 ? "" : i + 1 == parts.size() ? last : ", ") + parts[i];
    }
    return text;
}

std::string choices_of(const std::vector<Json>& choices) {
    std::vector<std::string> texts;
    for (const Json& choice : choices) texts.push_back(choice.dump());
    return listed(texts, " or ");
}

void check_number(const Cursor& at, const Schema& schema) {
    const Json& value = at.json();
    const bool whole = schema.kind == "integer";
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    // As in JSON Schema, 24.0 and 2.4e1 are the integer 24. All bounds are exact in double.
    if (number >= schema.lowest && number <= schema.highest &&
        (!whole || std::trunc(number) == number)) {
        return;
    }
    const auto text = [&](double bound) {
        return whole ? std::to_string(static_cast<std::int64_t>(bound)) : number_text(bound);
    };
    const std::string kind = whole ? "an integer" : "a number";
    at.wrong(schema.lowest == -schema.highest
                 ? kind + " within +-" + text(schema.highest)
                 : kind + " from " + text(schema.lowest) + " to " + text(schema.highest));
}

void check_text(const Cursor& at, const Schema& schema) {
    const Json& value = at.json();
    const std::string* const text = value.get_ptr<const std::string*>();
    if (schema.kind == "id") {
        if (!text || !is_id(*text)) at.wrong(kId);
    } else if (schema.kind == "name") {
        if (!text || !is_name(*text)) {
            at.wrong("a name of 1 to " + std::to_string(kMaxNameLength) +
                     " characters, none of them a control character");
        }
    } else if (!text) {
        at.wrong("a text");
    } else if (text->size() > schema.most) {
        at.fail("a text of " + std::to_string(text->size()) + " bytes",
                "at most " + std::to_string(schema.most));
    }
}

void check_list(const Cursor& at, const Schema& schema, int version) {
    const Json& value = at.json();
    const std::string of = schema.of.empty() ? at.name() : schema.of;
    const bool exact = schema.fewest == schema.most;
    const std::string count = exact ? std::to_string(schema.most) + ' ' : "";
    if (!value.is_array() || (exact && value.size() != schema.most)) {
        at.wrong("a list of " + count + of);
    }
    if (value.size() < schema.fewest) {
        at.wrong("at least " + std::to_string(schema.fewest) + " of the " + of);
    }
    at.limit(value.size(), schema.most, of);
    for (std::size_t i = 0; i < value.size(); ++i) {
        const bool own = !schema.variants.empty();
        check(at.element(i), own ? *schema.variants[i] : *schema.items, version);
    }
}

void check_object(const Cursor& at, const Schema& schema, int version) {
    const Json& value = at.json();
    if (!value.is_object()) at.wrong("an object");
    at.limit(value.size(), schema.most, schema.of);
    for (const auto& [name, member] : value.get_ref<const Json::object_t&>()) {
        const Cursor child = at.member(name.c_str(), member);
        const auto known = std::find_if(schema.members.begin(), schema.members.end(),
                                        [&name = name](const auto& m) { return m.first == name; });
        const auto& former = schema.former;
        if (known != schema.members.end()) {
            check(child, *known->second, version);
        } else if (schema.closed &&
                   (version > 1 || std::find(former.begin(), former.end(), name) == former.end())) {
            std::vector<std::string> names;
            for (const auto& [wanted, unused] : schema.members) names.push_back(wanted);
            child.fail("the unknown member " + in_quotes(name), "only " + listed(names, ", "));
        } else if (schema.named_by_ids && !is_id(name)) {
            at.fail("the member " + in_quotes(name), kId);
        } else if (schema.others) {
            check(child, *schema.others, version);
        }
    }
    for (const std::string& name : schema.required) at.member(name.c_str());
}

}  // namespace

const Schema& Schema::member(const std::string& name) const {
    for (const auto& [own, schema] : members) {
        if (own == name) return *schema;
    }
    throw std::logic_error("no member " + name + " in the schema");
}

const Schema& sidecar_schema() {
    static const Schema::Shared schema = [] {
        const Json root = Json::parse(kSidecarSchema);
        return schema_of(root, root);
    }();
    return *schema;
}

void check(const Cursor& at, const Schema& schema, int version) {
    const Json& value = at.json();
    const std::string& kind = schema.kind;
    if (kind == "object") {
        check_object(at, schema, version);
    } else if (kind == "array") {
        check_list(at, schema, version);
    } else if (kind == "number" || kind == "integer") {
        check_number(at, schema);
    } else if (kind == "string" || kind == "id" || kind == "name") {
        check_text(at, schema);
    } else if (kind == "boolean") {
        if (!value.is_boolean()) at.wrong("true or false");
    } else if (kind == "scalar") {
        if (value.is_structured()) at.wrong("a number, a text, true, false or null");
    } else if (kind == "enum") {
        const auto& choices = schema.choices;
        if (std::find(choices.begin(), choices.end(), value) == choices.end()) {
            at.wrong(choices_of(choices));
        }
    } else if (kind == "anyOf") {
        if (!value.is_object()) at.wrong("an object");
        const Cursor name = at.member("kind");
        std::vector<Json> kinds;
        for (const Schema::Shared& some : schema.variants) {
            kinds.push_back(some->member("kind").choices[0]);
            if (kinds.back() == name.json()) return check_object(at, *some, version);
        }
        name.wrong(choices_of(kinds));
    }
}

}  // namespace palette4d
