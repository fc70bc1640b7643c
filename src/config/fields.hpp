#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/interval.hpp"
#include "config/number_or_auto.hpp"
#include "config/uncertain.hpp"

/// A field table declares the keys of an options struct. It is one function, found by
/// argument-dependent lookup,
///
///     template <class Visitor> void visit_fields(Visitor& v, Options& o);
///
/// that names each member once with its key, unit, text and check. The default is the member's own
/// initialiser. Reading, checking, writing the resolved scene and the reference all use this
/// function. A visitor has
///
///     field(key, T& value, unit, text, Check<T> = {})    number, text, bool, vector or list
///     choice(key, E& value, text, {{E::a, "name", "meaning"}, ...})
///     group(key, S& value, text)                         nested table
///     list(key, std::vector<S>& value, text)             list of tables
///     variant(key, V& value, text)                       name that brings keys of its own
///
/// `choice` takes a container of Choice<E> too. The V of a variant is a value, possibly none, with
/// V(name), explicit operator bool, name(), meaning(), visit_keys(FieldVisitor&) and a static
/// alternatives() that returns one of each; its keys stand in the same table.
namespace livetet {

/// Whether all numbers in a value are finite; true for values without numbers.
template <class T>
bool is_finite(const T& value) {
    if constexpr (std::is_same_v<T, double>)
        return std::isfinite(value);
    else if constexpr (std::is_same_v<T, Uncertain>)
        return std::isfinite(value.value) && std::isfinite(value.spread);
    else if constexpr (std::is_same_v<T, NumberOrAuto>)
        return std::isfinite(value.number.value_or(0));
    else if constexpr (std::is_same_v<T, Eigen::Vector3d>)
        return value.allFinite();
    else if constexpr (std::is_same_v<T, std::vector<double>>) {
        for (const double x : value)
            if (!std::isfinite(x)) return false;
    }
    return true;
}

/// Condition on a value; `text` completes the sentence "must be ...". What is known as data, and
/// not only to the predicate, also enters the JSON schema.
template <class T>
struct Check {
    std::string text{};
    bool (*predicate)(const T&) = nullptr;
    Interval interval{};                    ///< of a number; of the number beside `auto`
    std::vector<std::string_view> names{};  ///< what the entries of a list may be; none: anything

    /// A value with a spread must fulfil the interval from value - spread to value + spread.
    bool holds(const T& value) const {
        if (predicate && !predicate(value)) return false;
        if constexpr (std::is_arithmetic_v<T>) {
            return interval.contains(value);
        } else if constexpr (std::is_same_v<T, Uncertain>) {
            return interval.contains(value.lowest()) && interval.contains(value.highest());
        } else if constexpr (std::is_same_v<T, NumberOrAuto>) {
            return value.is_auto() || interval.contains(*value.number);
        } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
            return names.empty() || std::all_of(value.begin(), value.end(), [&](const auto& name) {
                       return std::find(names.begin(), names.end(), name) != names.end();
                   });
        } else {
            return true;
        }
    }
};

/// The interval as a check. `reason` follows its text: ", where the material is positive definite".
template <class T = double>
Check<T> within(Interval interval, std::string_view reason = "") {
    return {interval.text().append(reason), nullptr, interval};
}
template <int Limit, class T = double>
Check<T> greater_than() {
    return within<T>({.low = Limit, .ends = Ends::low_excluded});
}
template <int Limit, class T = double>
Check<T> at_least() {
    return within<T>({.low = Limit});
}

/// A list whose entries are among `names`, literals.
inline Check<std::vector<std::string>> some_of(std::vector<std::string_view> names) {
    std::string text;
    for (const std::string_view name : names)
        text.append(text.empty() ? "some of " : ", ").append(name);
    return {std::move(text), nullptr, {}, std::move(names)};
}

/// One value of an enumeration: its name in files and its meaning in the reference.
template <class E>
struct Choice {
    E value;
    std::string_view name;
    std::string_view meaning;
};

/// Any visitor's `field` behind one type: for keys that are known at run time only.
class FieldVisitor {
  public:
    virtual ~FieldVisitor() = default;
    virtual void field(std::string_view key, double& value, std::string_view unit,
                       std::string_view text, Check<double> check = {}) = 0;
    virtual void field(std::string_view key, Eigen::Vector3d& value, std::string_view unit,
                       std::string_view text, Check<Eigen::Vector3d> check = {}) = 0;
    virtual void field(std::string_view key, std::optional<Eigen::Vector3d>& value,
                       std::string_view unit, std::string_view text,
                       Check<Eigen::Vector3d> check = {}) = 0;
};

/// `Visitor` as a FieldVisitor.
template <class Visitor>
class ErasedVisitor final : public FieldVisitor {
  public:
    explicit ErasedVisitor(Visitor& visitor) : visitor_(visitor) {}
    void field(std::string_view key, double& value, std::string_view unit, std::string_view text,
               Check<double> check) override {
        visitor_.field(key, value, unit, text, check);
    }
    void field(std::string_view key, Eigen::Vector3d& value, std::string_view unit,
               std::string_view text, Check<Eigen::Vector3d> check) override {
        visitor_.field(key, value, unit, text, check);
    }
    void field(std::string_view key, std::optional<Eigen::Vector3d>& value, std::string_view unit,
               std::string_view text, Check<Eigen::Vector3d> check) override {
        visitor_.field(key, value, unit, text, check);
    }

  private:
    Visitor& visitor_;
};

/// visitor.field(...) for each key of a variant's value.
template <class Visitor, class V>
void visit_keys(Visitor& visitor, V& value) {
    ErasedVisitor<Visitor> erased(visitor);
    value.visit_keys(erased);
}

namespace detail {
struct KeyCollector {
    std::vector<std::string> keys;
    template <class T, class C>
    void field(std::string_view key, T&, std::string_view, std::string_view, C) {
        keys.emplace_back(key);
    }
};
}  // namespace detail

/// The keys of a variant's value.
template <class V>
std::vector<std::string> keys_of(V& value) {
    detail::KeyCollector collector;
    visit_keys(collector, value);
    return std::move(collector.keys);
}

}  // namespace livetet
