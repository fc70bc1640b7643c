#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/fields.hpp"

namespace livetet {

/// Keys of a schema in the order in which they are written.
using Schema = nlohmann::ordered_json;

/// `schema` with the bounds of the interval.
Schema limited(Schema schema, const Interval& interval);

/// "NUMBER +- SPREAD", as parse_uncertain() reads it.
constexpr const char* uncertain_pattern =
    R"(^ *[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)? *\+-)"
    R"( *\+?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)? *$)";

/// What a key's value may be, as YamlReader reads it: a text may look like a number.
template <class T>
Schema schema_of_value(const Check<T>& check) {
    const Schema number = limited({{"type", "number"}}, check.interval);
    if constexpr (std::is_same_v<T, bool>) {
        return {{"type", "boolean"}};
    } else if constexpr (std::is_same_v<T, int>) {
        return limited({{"type", "integer"}}, check.interval);
    } else if constexpr (std::is_same_v<T, double>) {
        return number;
    } else if constexpr (std::is_same_v<T, Uncertain>) {
        return {{"anyOf", {number, {{"type", "string"}, {"pattern", uncertain_pattern}}}}};
    } else if constexpr (std::is_same_v<T, NumberOrAuto>) {
        return {{"anyOf", {number, {{"const", "auto"}}}}};
    } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
        return {
            {"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
    } else if constexpr (std::is_same_v<T, std::vector<double>>) {
        return {{"type", "array"}, {"items", {{"type", "number"}}}};
    } else if constexpr (std::is_same_v<T, std::vector<int>>) {
        return {{"type", "array"}, {"items", {{"type", "integer"}}}};
    } else {
        const Schema text{{"type", {"string", "number", "boolean"}}};
        if constexpr (!std::is_same_v<T, std::vector<std::string>>) return text;
        return {{"type", "array"},
                {"items", check.names.empty() ? text : Schema{{"enum", check.names}}}};
    }
}

/// A default as JSON; null: none worth stating.
template <class T>
Schema default_of(const T& value) {
    if constexpr (std::is_same_v<T, std::filesystem::path>)
        return value.empty() ? Schema() : Schema(value.string());
    else if constexpr (std::is_same_v<T, std::string>)
        return value.empty() ? Schema() : Schema(value);
    else if constexpr (std::is_same_v<T, Eigen::Vector3d>)
        return {value.x(), value.y(), value.z()};
    else if constexpr (std::is_same_v<T, Uncertain>)
        return value.spread == 0 ? Schema(value.value) : Schema(text_of(value));
    else if constexpr (std::is_same_v<T, NumberOrAuto>)
        return value.number ? Schema(*value.number) : Schema("auto");
    else
        return value;
}

/// Visitor that makes a JSON Schema (draft 7, which editors' YAML language servers know) of a field
/// table. It refuses unknown keys. Conditions between keys are left to the program.
class SchemaPrinter {
  public:
    template <class T>
    void field(std::string_view key, const T& value, std::string_view unit, std::string_view text,
               Check<T> check = {}) {
        Schema schema = described(unit, text, check.text);
        schema.update(schema_of_value(check));
        if (Schema preset = default_of(value); !preset.is_null()) schema["default"] = preset;
        add(key, std::move(schema));
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>&, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        Schema schema = described(unit, text, check.text);
        schema.update(schema_of_value(check));
        add(key, std::move(schema));
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, const E& value, std::string_view text,
                const Choices& choices) {
        std::vector<Name> names;
        std::string_view preset;
        for (const auto& c : choices) {
            names.push_back({c.name, c.meaning});
            if (c.value == value && preset.empty()) preset = c.name;
        }
        add(key, enumeration(text, names, preset));
    }
    template <class S>
    void group(std::string_view key, S&, std::string_view text) {
        add(key, table<S>(text));
    }
    template <class S>
    void group(std::string_view key, std::optional<S>&, std::string_view text) {
        add(key, table<S>(text));
    }
    template <class S>
    void list(std::string_view key, std::vector<S>&, std::string_view text) {
        Schema schema = described("", text, "");
        schema["type"] = {"array", "null"};
        schema["items"] = table<S>("");
        add(key, std::move(schema));
    }
    /// A key of an alternative is allowed with those names alone that bring it.
    template <class V>
    void variant(std::string_view key, V& value, std::string_view text) {
        std::vector<V> alternatives = V::alternatives();
        std::vector<Name> names;
        for (const V& a : alternatives) names.push_back({a.name(), a.meaning()});
        add(key, enumeration(text, names, value ? value.name() : ""));
        for (V& a : alternatives) {
            SchemaPrinter keys;
            visit_keys(keys, a);
            add_with(key, a.name(), value && value.name() == a.name(), keys.properties_);
        }
    }

    /// The table: its keys, and no others.
    Schema schema() const;

  private:
    struct Name {
        std::string_view name, meaning;
    };
    template <class S>
    static Schema table(std::string_view text) {
        SchemaPrinter inner;
        S defaults{};
        visit_fields(inner, defaults);
        Schema schema = described("", text, "");
        schema.update(inner.schema());
        return schema;
    }
    static Schema described(std::string_view unit, std::string_view text, std::string_view limit);
    static Schema enumeration(std::string_view text, const std::vector<Name>& names,
                              std::string_view preset);
    void add(std::string_view key, Schema schema);
    /// The keys that `variant: name` brings; without `variant`, too, if it is the default.
    void add_with(std::string_view variant, std::string_view name, bool is_default,
                  const Schema& keys);

    Schema properties_ = Schema::object();
    Schema dependencies_ = Schema::object();
};

/// The schema of files of table S, as text.
template <class S>
std::string schema_text(std::string_view title, std::string_view comment) {
    S defaults{};
    SchemaPrinter printer;
    visit_fields(printer, defaults);
    Schema schema{{"$schema", "http://json-schema.org/draft-07/schema#"},
                  {"$comment", comment},
                  {"title", title}};
    schema.update(printer.schema());
    return schema.dump(1) + "\n";
}

}  // namespace livetet
