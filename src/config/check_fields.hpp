#pragma once

#include <fmt/format.h>

#include <string>

#include "base/error.hpp"
#include "config/fields.hpp"

namespace livetet {

/// Visitor that checks the values of a table which a program filled in, as YamlReader checks those
/// of a file. Throws Error with key, value and limit: "materials[0].young_Pa = -1 Pa must be
/// greater than 0".
class FieldChecker {
  public:
    /// `prefix` comes before each key in messages: "materials[0].".
    explicit FieldChecker(std::string prefix) : prefix_(std::move(prefix)) {}

    template <class T>
    void field(std::string_view key, const T& value, std::string_view unit, std::string_view,
               Check<T> check = {}) {
        if (is_finite(value) && check.holds(value)) return;
        fail("{}{} = {}{}{} must be {}{}", prefix_, key, text_of(value), unit.empty() ? "" : " ",
             unit, check.text.empty() ? std::string_view("finite") : check.text,
             spread_note(value));
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>& value, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        if (value) field(key, *value, unit, text, check);
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, const E& value, std::string_view, const Choices& choices) {
        std::string names;
        for (const auto& c : choices) {
            if (c.value == value) return;
            names += fmt::format("{}{}", names.empty() ? "" : ", ", c.name);
        }
        fail("{}{} must be one of {}", prefix_, key, names);
    }
    template <class V>
    void variant(std::string_view, V& value, std::string_view) {
        visit_keys(*this, value);
    }

  private:
    template <class T>
    static std::string text_of(const T& value) {
        if constexpr (std::is_same_v<T, Eigen::Vector3d>)
            return fmt::format("[{}, {}, {}]", value.x(), value.y(), value.z());
        else if constexpr (std::is_same_v<T, Uncertain>)
            return livetet::text_of(value);
        else
            return fmt::format("{}", value);
    }
    std::string prefix_;
};

/// Checks all fields of a table (see FieldChecker).
template <class S>
void check_fields(S table, const std::string& prefix) {
    FieldChecker checker(prefix);
    visit_fields(checker, table);
}

}  // namespace livetet
