#include "apps/commands/json_schema.hpp"

#include <cmath>
#include <cstdint>

namespace livetet {

Schema limited(Schema schema, const Interval& interval) {
    // 3, not 3.0: as the bound is written in the field table.
    const auto bound = [](double x) {
        return x == std::round(x) && std::abs(x) < 1e15 ? Schema(static_cast<std::int64_t>(x))
                                                        : Schema(x);
    };
    if (interval.has_low())
        schema[interval.includes_low() ? "minimum" : "exclusiveMinimum"] = bound(interval.low);
    if (interval.has_high())
        schema[interval.includes_high() ? "maximum" : "exclusiveMaximum"] = bound(interval.high);
    return schema;
}

Schema SchemaPrinter::schema() const {
    Schema schema{{"type", {"object", "null"}}, {"properties", properties_}};
    if (!dependencies_.empty()) schema["dependencies"] = dependencies_;
    schema["additionalProperties"] = false;
    return schema;
}

Schema SchemaPrinter::described(std::string_view unit, std::string_view text,
                                std::string_view limit) {
    const std::string description =
        fmt::format("{}{}{}{}", unit.empty() ? "" : fmt::format("[{}] ", unit), text,
                    limit.empty() ? "" : "; must be ", limit);
    return description.empty() ? Schema::object() : Schema{{"description", description}};
}

Schema SchemaPrinter::enumeration(std::string_view text, const std::vector<Name>& names,
                                  std::string_view preset) {
    std::string description(text);
    Schema values = Schema::array(), meanings = Schema::array();
    for (const Name& n : names) {
        description += fmt::format("\n\n`{}`: {}", n.name, n.meaning);
        values.push_back(n.name);
        meanings.push_back(n.meaning);
    }
    // enumDescriptions is no part of the standard: editors show it beside each name.
    Schema schema{{"description", description}, {"enum", values}, {"enumDescriptions", meanings}};
    if (!preset.empty()) schema["default"] = preset;
    return schema;
}

void SchemaPrinter::add(std::string_view key, Schema schema) {
    properties_[std::string(key)] = std::move(schema);
}

void SchemaPrinter::add_with(std::string_view variant, std::string_view name, bool is_default,
                             const Schema& keys) {
    const std::string variant_key(variant);
    for (const auto& [key, schema] : keys.items()) {
        if (!properties_.contains(key)) {
            properties_[key] = schema;
            dependencies_[key] = {
                {"properties", {{variant_key, {{"enum", Schema::array()}}}}},
                {"required", Schema::array({variant_key})},
            };
        } else if (properties_[key] != schema) {
            properties_[key] = {{"anyOf", {properties_[key], schema}}};
        }
        Schema& condition = dependencies_[key];
        condition["properties"][variant_key]["enum"].push_back(name);
        if (is_default) condition.erase("required");
    }
}

}  // namespace livetet
