#pragma once

#include <Eigen/Core>

#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

/// A field table is one function, found by argument-dependent look-up,
///     template <class Visitor> void visit_fields(Visitor& v, Options& o);
/// that names each member once: its key, unit, text, check; its default is the member's own
/// initialiser. Reading, checking, writing the resolved scene and the reference all come from that
/// one function. A visitor has
///     field(key, T& value, unit, text, Check<T> = {})        a number, text, truth value, vector
///     or list of them choice(key, E& value, text, {{E::a, "name", "meaning"}, ...}) group(key, S&
///     value, text)                              a nested table list(key, std::vector<S>& value,
///     text)                  a list of tables
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

}  // namespace livetet
