#include "describe_json.hpp"

#include <nlohmann/json.hpp>

namespace strict {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Value& value) {
    if (const int* number = std::get_if<int>(&value)) return *number;
    if (const double* number = std::get_if<double>(&value)) return *number;
    if (const std::string* text = std::get_if<std::string>(&value)) return *text;
    return nullptr;
}

Json to_json(const std::vector<Value>& values) {
    if (values.size() == 1) return to_json(values.front());
    Json array = Json::array();
    for (const Value& value : values) array.push_back(to_json(value));
    return array;
}

Json to_json(const OfxParamStruct& param) {
    const OfxPropertySetStruct& properties = param.properties;
    Json json = {{"type", param.type}, {"label", properties.text(kOfxPropLabel)}};
    json["options"] = Json::array();
    if (properties.has(kOfxParamPropChoiceOption)) {
        for (const Value& option : properties.values.at(kOfxParamPropChoiceOption)) {
            json["options"].push_back(to_json(option));
        }
    }
    static const std::map<std::string, const char*> names = {
        {kOfxParamPropDefault, "default"},
        {kOfxParamPropMin, "min"},
        {kOfxParamPropMax, "max"},
        {kOfxParamPropDisplayMin, "displayMin"},
        {kOfxParamPropDisplayMax, "displayMax"},
        {kOfxParamPropAnimates, "animates"}};
    for (const auto& [property, name] : names) {
        if (properties.has(property)) json[name] = to_json(properties.values.at(property));
    }
    return json;
}

}  // namespace

std::string described_json(const OfxImageEffectStruct& descriptor) {
    Json all = Json::object();
    for (const std::string& name : descriptor.params.order) {
        all[name] = to_json(*descriptor.params.params.at(name));
    }
    return all.dump(1);
}

}  // namespace strict
