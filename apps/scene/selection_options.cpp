#include "apps/scene/selection_options.hpp"

#include <fmt/format.h>

#include <string_view>

#include "base/error.hpp"
#include "config/key_places.hpp"

namespace livetet {

int selections_in(const SelectionOptions& s) {
    return s.mask.has_value() + s.group.has_value() + s.box_mm.has_value() +
           s.sphere_mm.has_value() + s.half_space_mm.has_value() + s.nodes.has_value();
}

void check_selection(const SelectionOptions& s, const std::string& key, const KeyPlaces& places) {
    const int given = selections_in(s);
    if (given != 1)
        fail(
            "{} names {} of mask, group, box_mm, sphere_mm, half_space_mm, nodes, expected exactly "
            "one ({})",
            key, given, places(key));
    const auto check_size = [&](const std::optional<std::vector<double>>& values,
                                std::string_view name, std::size_t size) {
        if (values && values->size() != size)
            fail("{}.{} has {} numbers, expected {} ({})", key, name, values->size(), size,
                 places(fmt::format("{}.{}", key, name)));
    };
    check_size(s.box_mm, "box_mm", 6);
    check_size(s.sphere_mm, "sphere_mm", 4);
    check_size(s.half_space_mm, "half_space_mm", 6);
}

}  // namespace livetet
