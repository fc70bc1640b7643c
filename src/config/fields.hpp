#pragma once

#include <Eigen/Core>

#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

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
namespace livetet {

/// Condition on a value; `text` completes the sentence "must be ...".
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

/// One value of an enumeration: its name in files and its meaning in the reference.
template <class E>
struct Choice {
    E value;
    std::string_view name;
    std::string_view meaning;
};

}  // namespace livetet
