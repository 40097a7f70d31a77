#include "sidecar/schema.hpp"

#include <nlohmann/json.hpp>

#include "sidecar/json_tree.hpp"

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
    const std::string write = node.value("write", "");
    result->rows = result->rows || write == "rows";
    result->real = result->real || write == "real";
    result->whole = result->whole || write == "whole" || node.value("type", Json()) == "integer";
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
    if (Schema::Shared items = part("items")) result->items = items;
    // All elements of these lists are of one kind.
    if (node.contains("prefixItems")) result->items = schema_of(node["prefixItems"][0], root);
    return result;
}

}  // namespace

const Schema& sidecar_schema() {
    static const Schema::Shared schema = [] {
        const Json root = Json::parse(kSidecarSchema);
        return schema_of(root, root);
    }();
    return *schema;
}

}  // namespace palette4d
