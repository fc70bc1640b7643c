#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "config/fields.hpp"

namespace livetet {

/// The candidate with the smallest edit distance to `word`; empty if the distance exceeds half its
/// length.
std::string nearest_name(std::string_view word, const std::vector<std::string>& candidates);

/// Converts a YAML scalar or sequence. Throws YAML::Exception if it is not a value of type T.
template <class T>
T yaml_value(const YAML::Node& node) {
    if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
        const auto values = node.as<std::vector<double>>();
        if (values.size() != 3) throw YAML::Exception(node.Mark(), "three numbers");
        return {values[0], values[1], values[2]};
    } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
        return node.as<std::string>();
    } else if constexpr (std::is_same_v<T, Uncertain>) {
        const std::string text = node.as<std::string>();
        if (text.find("+-") == std::string::npos) return node.as<double>();
        const auto value = parse_uncertain(text);
        if (!value) throw YAML::Exception(node.Mark(), "a number and its spread");
        return *value;
    } else if constexpr (std::is_same_v<T, NumberOrAuto>) {
        if (node.as<std::string>() == "auto") return {};
        return {node.as<double>()};
    } else {
        return node.as<T>();
    }
}

/// Name of a value's type for messages: "must be ...".
template <class T>
std::string_view type_text() {
    if constexpr (std::is_same_v<T, bool>)
        return "true or false";
    else if constexpr (std::is_same_v<T, int>)
        return "a whole number";
    else if constexpr (std::is_same_v<T, double>)
        return "a number";
    else if constexpr (std::is_same_v<T, Uncertain>)
        return "a number, or NUMBER +- SPREAD";
    else if constexpr (std::is_same_v<T, NumberOrAuto>)
        return "a number, or auto";
    else if constexpr (std::is_same_v<T, Eigen::Vector3d>)
        return "three numbers [x, y, z]";
    else if constexpr (std::is_same_v<T, std::vector<double>>)
        return "a list of numbers";
    else if constexpr (std::is_same_v<T, std::vector<int>>)
        return "a list of whole numbers";
    else if constexpr (std::is_same_v<T, std::vector<std::string>>)
        return "a list of texts";
    else if constexpr (std::is_same_v<T, std::filesystem::path>)
        return "a file name";
    else
        return "a text";
}

/// The range of int, as " from A to B", if a whole number in `found` is outside of it; else empty.
std::string range_missed_by(std::string_view found);

/// Visitor that reads a table from a YAML mapping. Every error message gives the key, the value
/// found, the values allowed, and file:line.
class YamlReader {
  public:
    YamlReader(YAML::Node node, std::string file, std::string prefix = "")
        : node_(std::move(node)), file_(std::move(file)), prefix_(std::move(prefix)) {
        if (node_ && !node_.IsNull() && !node_.IsMap())
            fail("{} must be a table of keys ({})",
                 prefix_.empty() ? "the file" : prefix_.substr(0, prefix_.size() - 1),
                 place(node_));
    }

    template <class T>
    void field(std::string_view key, T& value, std::string_view unit, std::string_view,
               Check<T> check = {}) {
        const YAML::Node node = find(key);
        if (!node) return;
        value = convert<T>(key, node);
        if (!is_finite(value) || !check.holds(value))
            fail("{}{} = {}{}{} must be {}{} ({})", prefix_, key, text_of(node),
                 unit.empty() ? "" : " ", unit,
                 check.text.empty() ? std::string_view("finite") : check.text, spread_note(value),
                 place(node));
    }
    template <class T>
    void field(std::string_view key, std::optional<T>& value, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        if (!find(key)) return;
        T given{};
        field(key, given, unit, text, check);
        value = given;
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, E& value, std::string_view, const Choices& choices) {
        const YAML::Node node = find(key);
        if (!node) return;
        const auto given = convert<std::string>(key, node);
        std::string names;
        for (const auto& c : choices) {
            if (c.name == given) {
                value = c.value;
                return;
            }
            names += fmt::format("{}{}", names.empty() ? "" : ", ", c.name);
        }
        fail("{}{} = {} must be one of {} ({})", prefix_, key, given, names, place(node));
    }
    template <class S>
    void group(std::string_view key, S& value, std::string_view) {
        if (const YAML::Node node = find(key))
            read(node, fmt::format("{}{}.", prefix_, key), value);
    }
    template <class S>
    void group(std::string_view key, std::optional<S>& value, std::string_view text) {
        if (!find(key)) return;
        value.emplace();
        group(key, *value, text);
    }
    template <class S>
    void list(std::string_view key, std::vector<S>& values, std::string_view) {
        const YAML::Node node = find(key);
        if (!node || node.IsNull()) return;
        if (!node.IsSequence())
            fail("{}{} must be a list, each entry behind a dash ({})", prefix_, key, place(node));
        values.clear();
        for (std::size_t i = 0; i < node.size(); ++i)
            read(node[i], fmt::format("{}{}[{}].", prefix_, key, i), values.emplace_back());
    }
    template <class V>
    void variant(std::string_view key, V& value, std::string_view) {
        if (const YAML::Node node = find(key)) {
            const auto given = convert<std::string>(key, node);
            std::vector<std::string> names;
            for (const V& a : V::alternatives()) names.emplace_back(a.name());
            if (std::find(names.begin(), names.end(), given) == names.end())
                fail("{}{} = {} must be one of {} ({})", prefix_, key, given,
                     fmt::join(names, ", "), place(node));
            value = V(given);
        }
        visit_keys(*this, value);
        for (V& a : V::alternatives())
            for (std::string& other : keys_of(a))
                keys_of_others_.push_back(
                    {std::move(other), fmt::format("{}: {}", key, a.name()),
                     value ? fmt::format("{}: {}", key, value.name()) : fmt::format("no {}", key)});
    }

    /// After the visit: throws Error if a key is not in the table, suggesting the nearest one.
    void check_all_known() const;

    template <class S>
    void read(const YAML::Node& node, const std::string& prefix, S& value) {
        YamlReader inner(node, file_, prefix);
        visit_fields(inner, value);
        inner.check_all_known();
    }

  private:
    YAML::Node find(std::string_view key) {
        known_.emplace_back(key);
        if (!node_ || !node_.IsMap()) return YAML::Node(YAML::NodeType::Undefined);
        return node_[std::string(key)];
    }
    template <class T>
    T convert(std::string_view key, const YAML::Node& node) const {
        if (node.IsNull())  // yaml-cpp reads it as the text "null"
            fail("{}{} has no value, expected {}, or no such key for its default ({})", prefix_,
                 key, type_text<T>(), place_of_key(key));
        try {
            return yaml_value<T>(node);
        } catch (const YAML::Exception&) {
            const std::string found = text_of(node);
            const bool whole = std::is_same_v<T, int> || std::is_same_v<T, std::vector<int>>;
            fail("{}{} = {} must be {}{} ({})", prefix_, key, found, type_text<T>(),
                 whole ? range_missed_by(found) : "", place(node));
        }
    }
    std::string place(const YAML::Node& node) const {
        return node.Mark().is_null() ? file_ : fmt::format("{}:{}", file_, node.Mark().line + 1);
    }
    /// The parser places a value that is missing where the next one begins.
    std::string place_of_key(std::string_view key) const {
        for (const auto& entry : node_)
            if (entry.first.IsScalar() && entry.first.Scalar() == key) return place(entry.first);
        return file_;
    }
    static std::string text_of(const YAML::Node& node);

    YAML::Node node_;
    std::string file_;
    std::string prefix_;
    std::vector<std::string> known_;
    struct KeyOfVariant {
        std::string key, with, found;  ///< "k2", "model: a", "model: b"
    };
    std::vector<KeyOfVariant> keys_of_others_;
};

/// Reads a table from a YAML node. Throws Error as YamlReader does.
template <class S>
S read_yaml(const YAML::Node& node, const std::string& file) {
    S value;
    YamlReader reader(node, file);
    visit_fields(reader, value);
    reader.check_all_known();
    return value;
}

/// Reads a table from YAML text. Also throws Error for invalid YAML, with the line.
template <class S>
S read_yaml(const std::string& text, const std::string& file) {
    YAML::Node node;
    try {
        node = YAML::Load(text);
    } catch (const YAML::Exception& e) {
        fail("{}:{}: not YAML: {}", file, e.mark.line + 1, e.msg);
    }
    return read_yaml<S>(node, file);
}

/// Visitor that writes a table with all resolved values, as YAML that reads back to the same
/// values.
class YamlWriter {
  public:
    explicit YamlWriter(YAML::Emitter& out) : out_(out) {}

    template <class T>
    void field(std::string_view key, const T& value, std::string_view, std::string_view,
               Check<T> = {}) {
        out_ << YAML::Key << std::string(key) << YAML::Value;
        put(value);
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>& value, std::string_view unit,
               std::string_view text, Check<T> = {}) {
        if (value) field(key, *value, unit, text);
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, const E& value, std::string_view, const Choices& choices) {
        for (const auto& c : choices)
            if (c.value == value)
                out_ << YAML::Key << std::string(key) << YAML::Value << std::string(c.name);
    }
    template <class S>
    void group(std::string_view key, S& value, std::string_view) {
        out_ << YAML::Key << std::string(key) << YAML::Value;
        write(value);
    }
    template <class S>
    void group(std::string_view key, std::optional<S>& value, std::string_view text) {
        if (value) group(key, *value, text);
    }
    template <class S>
    void list(std::string_view key, std::vector<S>& values, std::string_view) {
        out_ << YAML::Key << std::string(key) << YAML::Value;
        if (values.empty())
            out_ << YAML::Flow;  // written explicitly, as the default may have entries
        out_ << YAML::BeginSeq;
        for (S& value : values) write(value);
        out_ << YAML::EndSeq;
    }
    template <class V>
    void variant(std::string_view key, V& value, std::string_view) {
        if (!value) return;
        out_ << YAML::Key << std::string(key) << YAML::Value << std::string(value.name());
        visit_keys(*this, value);
    }
    template <class S>
    void write(S& value) {
        out_ << YAML::BeginMap;
        visit_fields(*this, value);
        out_ << YAML::EndMap;
    }

  private:
    void put(const Eigen::Vector3d& v) {
        out_ << YAML::Flow << std::vector<double>{v.x(), v.y(), v.z()};
    }
    void put(const std::filesystem::path& p) { out_ << p.string(); }
    void put(const Uncertain& x) {
        if (x.spread == 0)
            out_ << x.value;
        else
            out_ << livetet::text_of(x);
    }
    void put(const NumberOrAuto& x) {
        if (x.number)
            out_ << *x.number;
        else
            out_ << "auto";
    }
    template <class T>
    void put(const std::vector<T>& v) {
        out_ << YAML::Flow << v;
    }
    template <class T>
    void put(const T& v) {
        out_ << v;
    }
    YAML::Emitter& out_;
};

/// The table as YAML text, with all resolved values.
template <class S>
std::string to_yaml(S value) {
    YAML::Emitter out;
    out.SetDoublePrecision(std::numeric_limits<double>::max_digits10);
    YamlWriter writer(out);
    writer.write(value);
    return std::string(out.c_str()) + "\n";
}

/// A key's value as a scene file states it; numbers in the shortest form that reads back equal to
/// 15 digits.
template <class T>
std::string yaml_text(std::string_view key, const T& value) {
    YAML::Emitter out;
    out.SetDoublePrecision(std::numeric_limits<double>::digits10);
    YamlWriter(out << YAML::BeginMap).field(key, value, "", "");
    out << YAML::EndMap;
    const std::string pair = out.c_str();
    return pair.substr(std::min(pair.find(':') + 2, pair.size()));
}

/// Visitor that prints the reference of a table: key, default, unit, meaning.
class ReferencePrinter {
  public:
    template <class T>
    void field(std::string_view key, const T& value, std::string_view unit, std::string_view text,
               Check<T> check = {}) {
        row(key, yaml_text(key, value), unit, text, check.text);
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>&, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        row(key, "(not given)", unit, text, check.text);
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, const E& value, std::string_view text,
                const Choices& choices) {
        for (const auto& c : choices)
            if (c.value == value) row(key, std::string(c.name), "", text, "");
        for (const auto& c : choices) meaning(c.name, c.meaning);
    }
    template <class V>
    void variant(std::string_view key, V& value, std::string_view text) {
        row(key, value ? std::string(value.name()) : "(not given)", "", text, "");
        std::vector<V> alternatives = V::alternatives();
        for (const V& a : alternatives) meaning(a.name(), a.meaning());
        for (V& a : alternatives) {
            if (keys_of(a).empty()) continue;
            text_ += fmt::format("{:{}}# with {}: {}\n", "", indent_, key, a.name());
            visit_keys(*this, a);
        }
    }
    template <class S>
    void group(std::string_view key, S&, std::string_view text) {
        S defaults{};
        heading(key, text);
        inner(defaults);
    }
    template <class S>
    void group(std::string_view key, std::optional<S>&, std::string_view text) {
        S defaults{};
        group(key, defaults, text);
    }
    template <class S>
    void list(std::string_view key, std::vector<S>&, std::string_view text) {
        S defaults{};
        heading(key, fmt::format("(a list) {}", text));
        inner(defaults);
    }
    const std::string& text() const { return text_; }

  private:
    template <class S>
    void inner(S& defaults) {
        indent_ += 2;
        visit_fields(*this, defaults);
        indent_ -= 2;
    }
    void heading(std::string_view key, std::string_view text);
    void meaning(std::string_view name, std::string_view text) {
        text_ += fmt::format("{:{}}{:<24}   {}: {}\n", "", indent_, "", name, text);
    }
    void row(std::string_view key, const std::string& value, std::string_view unit,
             std::string_view text, std::string_view check);
    std::string text_;
    int indent_ = 0;
};

/// The reference of a table as text.
template <class S>
std::string reference_of() {
    S defaults{};
    ReferencePrinter printer;
    visit_fields(printer, defaults);
    return printer.text();
}

}  // namespace livetet
