#include "mesh/hex_transfer.hpp"

namespace livetet {

int place_in_parent(int octant, int corner) {
    int place = 0, power = 1;
    for (int d = 0; d < 3; ++d, power *= 3)
        place += power * ((octant >> d & 1) + (corner >> d & 1));
    return place;
}

const std::array<std::array<double, 8>, places_in_parent>& corner_values_at_places() {
    static const auto values = [] {
        std::array<std::array<double, 8>, places_in_parent> all{};
        for (int place = 0; place < places_in_parent; ++place) {
            const int at[3] = {place % 3, place / 3 % 3, place / 9};
            for (int c = 0; c < 8; ++c) {
                double w = 1;
                for (int d = 0; d < 3; ++d) w *= (c >> d & 1 ? at[d] : 2 - at[d]) / 2.0;
                all[place][c] = w;
            }
        }
        return all;
    }();
    return values;
}

std::vector<std::int32_t> places_in_coarser(const HexLevel& fine) {
    std::vector<std::int32_t> from(fine.nodes, 0);
    for (std::size_t e = 0; e < fine.cells.size(); ++e) {
        const int octant = octant_of(fine.places[e]);
        for (int c = 0; c < 8; ++c)
            from[fine.cells[e][c]] =
                places_in_parent * fine.parents[e] + place_in_parent(octant, c);
    }
    return from;
}

}  // namespace livetet
