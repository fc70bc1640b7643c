#pragma once

#include <Eigen/Core>

#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

/// A field table is one function, found by argument-dependent look-up,
///     template <class Visitor> void visit_fields(Visitor& v, Options& o);
/// that names each member once: its key, unit, text, check; its default is the member's own
/// initialiser. Reading, checking, writing the resolved scene and the reference all come from that
/// one function. A visitor has
///     field(key, T& value, unit, text, Check<T> = {})
///         a number, text, truth value, vector or list of them
///     choice(key, E& value, text, {{E::a, "name", "meaning"}, ...})
///         one of a list, which may be a container of Choice<E> too
///     group(key, S& value, text)
///         a nested table
///     list(key, std::vector<S>& value, text)
///         a list of tables
///     variant(key, V& value, text)
///         a name, or none, that brings keys of its own into the same table. V is a value with
///         V(name), explicit operator bool, name(), meaning(), visit_keys(FieldVisitor&) and a
///         static alternatives() that returns one of each
namespace livetet {

/// What a value must be; `text` completes "must be ...".
template <class T>
struct Check {
    std::string_view text{};
    bool (*holds)(const T&) = nullptr;
};

namespace detail {
template <int Limit>
constexpr std::string_view limit_text(bool inclusive) {
    static_assert(Limit == 0 || Limit == 1, "add the text for this limit");
    if constexpr (Limit == 0) return inclusive ? "at least 0" : "greater than 0";
    return inclusive ? "at least 1" : "greater than 1";
}
}  // namespace detail

template <int Limit, class T = double>
constexpr Check<T> greater_than() {
    return {detail::limit_text<Limit>(false), [](const T& x) { return x > Limit; }};
}
template <int Limit, class T = double>
constexpr Check<T> at_least() {
    return {detail::limit_text<Limit>(true), [](const T& x) { return x >= Limit; }};
}

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
