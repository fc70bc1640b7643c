#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/fields.hpp"

namespace livetet {

/// `key` without the indices of lists: "materials.young_Pa" of "materials[0].young_Pa".
inline std::string without_indices(std::string_view key) {
    std::string path;
    bool index = false;
    for (const char c : key) {
        index = c == '[' || (index && c != ']');
        if (!index && c != ']') path += c;
    }
    return path;
}

/// Visitor that finds the unit of the key at a path such as "materials.young_Pa".
class UnitFinder {
  public:
    explicit UnitFinder(std::string path) : path_(std::move(path)) {}

    template <class T>
    void field(std::string_view key, const T&, std::string_view unit, std::string_view,
               Check<T> = {}) {
        note(key, unit);
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>&, std::string_view unit,
               std::string_view, Check<T> = {}) {
        note(key, unit);
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view, const E&, std::string_view, const Choices&) {}
    template <class V>
    void variant(std::string_view, V&, std::string_view) {
        for (V& a : V::alternatives()) visit_keys(*this, a);
    }
    template <class S>
    void group(std::string_view key, S&, std::string_view) {
        inside<S>(key);
    }
    template <class S>
    void group(std::string_view key, std::optional<S>&, std::string_view) {
        inside<S>(key);
    }
    template <class S>
    void list(std::string_view key, std::vector<S>&, std::string_view) {
        inside<S>(key);
    }

    const std::string& unit() const { return unit_; }

  private:
    template <class S>
    void inside(std::string_view key) {
        if (!path_.starts_with(std::string(key) + ".")) return;
        UnitFinder finder(path_.substr(key.size() + 1));
        S defaults{};
        visit_fields(finder, defaults);
        unit_ = finder.unit_;
    }
    void note(std::string_view key, std::string_view unit) {
        if (key == path_) unit_ = unit;
    }

    std::string path_, unit_;
};

/// The unit of a key of table S, as its reference states it: "Pa" for "materials[0].young_Pa".
/// Empty if it has none, or if there is no such key.
template <class S>
std::string unit_of(std::string_view key) {
    UnitFinder finder(without_indices(key));
    S defaults{};
    visit_fields(finder, defaults);
    return finder.unit();
}

}  // namespace livetet
