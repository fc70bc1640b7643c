#include "mesh/rest_places.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

/// Share of a cell's shortest edge to which rest places are found.
constexpr double place_tolerance = 1e-7;
/// Of the table of near cells: 16 MB.
constexpr std::int64_t max_blocks = std::int64_t{1} << 22;

std::array<std::int32_t, 3> blocks_of(const PlaceNumbers& numbers, int shift) {
    std::array<std::int32_t, 3> blocks{};
    for (int d = 0; d < 3; ++d) blocks[d] = ((numbers.size(d) - 1) >> shift) + 1;
    return blocks;
}

}  // namespace

RestPlaces::RestPlaces(const HexLevel& level, const GridFrame& frame)
    : places_(level.places),
      numbers_(level.places),
      corner_(frame.corner),
      in_cells_(frame.axes.inverse()),
      tolerance_(place_tolerance * frame.axes.colwise().norm().minCoeff()) {
    for (std::size_t e = 0; e < places_.size(); ++e)
        cells_.emplace_back(numbers_.of_place(places_[e]), static_cast<std::int32_t>(e));
    std::sort(cells_.begin(), cells_.end());
    for (;; ++shift_) {
        blocks_ = blocks_of(numbers_, shift_);
        if (std::int64_t{blocks_[0]} * blocks_[1] * blocks_[2] <= max_blocks) break;
    }
    find_near_cells();
}

/// Fills the blocks with cells, then spreads these to blocks without, ring by ring.
void RestPlaces::find_near_cells() {
    const auto number = [&](const HexPlace& block) {
        return (static_cast<std::size_t>(block[2]) * blocks_[1] + block[1]) * blocks_[0] + block[0];
    };
    near_.assign(static_cast<std::size_t>(blocks_[0]) * blocks_[1] * blocks_[2], -1);
    std::vector<HexPlace> front;
    for (std::size_t e = 0; e < places_.size(); ++e) {
        HexPlace block = places_[e];
        for (std::int32_t& c : block) c >>= shift_;
        std::int32_t& cell = near_[number(block)];
        if (cell >= 0) continue;
        cell = static_cast<std::int32_t>(e);
        front.push_back(block);
    }
    for (std::size_t next = 0; next < front.size(); ++next) {
        const HexPlace from = front[next];
        for (int d = 0; d < 3; ++d)
            for (const int way : {-1, 1}) {
                HexPlace to = from;
                to[d] += way;
                if (to[d] < 0 || to[d] >= blocks_[d] || near_[number(to)] >= 0) continue;
                near_[number(to)] = near_[number(from)];
                front.push_back(to);
            }
    }
}

std::optional<std::int32_t> RestPlaces::cell_at(const HexPlace& place) const {
    const std::int64_t number = numbers_.of_place(place);
    const auto cell = std::lower_bound(cells_.begin(), cells_.end(), std::pair{number, 0});
    if (cell == cells_.end() || cell->first != number) return {};
    return cell->second;
}

std::int32_t RestPlaces::cell_near(const HexPlace& place) const {
    if (const auto cell = cell_at(place)) return *cell;
    return near_[(static_cast<std::size_t>(place[2] >> shift_) * blocks_[1] +
                  (place[1] >> shift_)) *
                     blocks_[0] +
                 (place[0] >> shift_)];
}

bool RestPlaces::holds(const Vector3& x) const {
    const Vector3 q = in_cells_ * (x - corner_);
    HexPlace place{};
    for (int d = 0; d < 3; ++d) {
        if (!(q[d] >= 0 && q[d] < numbers_.size(d))) return false;
        place[d] = static_cast<std::int32_t>(q[d]);
    }
    return cell_at(place).has_value();
}

RestMotion RestPlaces::motion_at(const Vector3& x, std::span<const Hexahedron> cells,
                                 std::span<const Vector3> displacement) const {
    const Vector3 q = in_cells_ * (x - corner_);
    HexPlace place{};
    for (int d = 0; d < 3; ++d)
        place[d] =
            static_cast<std::int32_t>(std::clamp(std::floor(q[d]), 0.0, numbers_.size(d) - 1.0));
    const std::int32_t e = cell_near(place);
    Vector3 at = q, slope = Vector3::Ones();
    for (int d = 0; d < 3; ++d) {
        at[d] = std::clamp(q[d] - places_[e][d], 0.0, 1.0);
        if (at[d] != q[d] - places_[e][d]) slope[d] = 0;  // u is constant beyond the cell
    }
    Vector3 u = Vector3::Zero();
    Eigen::Matrix3d by_cells = Eigen::Matrix3d::Zero();  // du / dq
    for (int c = 0; c < 8; ++c) {
        Vector3 weight;
        for (int d = 0; d < 3; ++d) weight[d] = c >> d & 1 ? at[d] : 1 - at[d];
        const Vector3& value = displacement[cells[e][c]];
        u += weight.prod() * value;
        for (int d = 0; d < 3; ++d)
            by_cells.col(d) += (c >> d & 1 ? slope[d] : -slope[d]) * weight[(d + 1) % 3] *
                               weight[(d + 2) % 3] * value;
    }
    return {u, Eigen::Matrix3d::Identity() + by_cells * in_cells_};
}

Vector3 RestPlaces::rest_place(const Vector3& y, std::span<const Hexahedron> cells,
                               std::span<const Vector3> displacement) const {
    return find_rest_place(y, tolerance_,
                           [&](const Vector3& x) { return motion_at(x, cells, displacement); });
}

}  // namespace livetet
