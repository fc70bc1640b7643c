#include "image/tet_raster.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

/// Slices in a slab: 2 MB of vectors and ranks at 256 x 256 voxels.
constexpr int slab_slices = 2;

/// Weights down to this count as inside, so that rounding cannot leave a voxel on an inner face to
/// neither tet.
constexpr double raster_tolerance = 1e-9;

/// The rank of a vector v is (|v|^2 + 1e-4 m^2) times the scale of its tet's kind. The ranges of
/// the scales do not overlap.
constexpr float rank_floor = 1e-4F;
constexpr float rank_scale[2][2] = {{1, 1e8F}, {1e17F, 1e26F}};  // [inverted][second class]
static_assert(rank_scale[1][0] * rank_floor >= inverted_rank);

/// The integers from low to high that are in [0, size), as a half-open range.
std::pair<int, int> whole_numbers(double low, double high, int size) {
    return {static_cast<int>(std::clamp(std::ceil(low), 0.0, static_cast<double>(size))),
            static_cast<int>(std::clamp(std::floor(high) + 1, 0.0, static_cast<double>(size)))};
}

/// A tet's corners as columns, and its bounding box.
struct Corners {
    Eigen::Matrix<double, 3, 4> x;
    Eigen::Vector3d low, high;

    Corners(std::span<const Vector3> nodes, const Tet& t) {
        for (int c = 0; c < 4; ++c) x.col(c) = nodes[t[c]];
        low = x.rowwise().minCoeff().array() - raster_tolerance;
        high = x.rowwise().maxCoeff().array() + raster_tolerance;
    }
};

}  // namespace

void RasterSlab::clear(int first_slice, int last_slice, std::size_t voxels_a_slice) {
    first = first_slice;
    last = last_slice;
    const std::size_t count = voxels_a_slice * (last - first);
    values.resize(count);
    ranks.assign(count, uncovered);
}

TetRaster::TetRaster(const ImageGrid& grid, std::span<const Tet> tets, std::size_t first_class,
                     std::span<const Vector3> nodes, std::span<const Vector3> values)
    : grid_(grid), tets_(tets), first_class_(first_class), values_(values) {
    const Eigen::Affine3d voxel_from_ras(Eigen::Matrix4d(grid.ras_from_voxel.inverse()));
    places_.reserve(nodes.size());
    for (const Vector3& x : nodes) places_.push_back(voxel_from_ras * x);

    const int slabs = (grid.size[2] + slab_slices - 1) / slab_slices;
    std::vector<std::pair<std::int32_t, std::int32_t>> slabs_of(tets_.size());
    first_.assign(slabs + 1, 0);
    for (std::size_t t = 0; t < tets_.size(); ++t) {
        const Corners c(places_, tets_[t]);
        const auto [first, last] = whole_numbers(c.low.z(), c.high.z(), grid_.size[2]);
        if (first >= last) continue;
        slabs_of[t] = {first / slab_slices, (last - 1) / slab_slices + 1};
        for (int s = slabs_of[t].first; s < slabs_of[t].second; ++s) ++first_[s + 1];
    }
    for (int s = 0; s < slabs; ++s) first_[s + 1] += first_[s];
    list_.resize(first_.back());
    std::vector<std::int32_t> at(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < tets_.size(); ++t)
        for (int s = slabs_of[t].first; s < slabs_of[t].second; ++s)
            list_[at[s]++] = static_cast<std::int32_t>(t);
}

RasterSlab TetRaster::make_slab() const {
    RasterSlab slab;
    slab.clear(0, std::min(slab_slices, grid_.size[2]), voxels_a_slice());
    return slab;
}

void TetRaster::draw(int s, RasterSlab& slab) const {
    slab.clear(s * slab_slices, std::min((s + 1) * slab_slices, grid_.size[2]), voxels_a_slice());
    for (std::int32_t at = first_[s]; at < first_[s + 1]; ++at) draw_tet(list_[at], slab);
}

/// Barycentric weights and value are affine in the voxel index (i, j, k), so both change by a
/// constant step along a row. The ends of the row follow from w_c(i) = w_c(0) + i d_c >= 0 for all
/// four weights.
void TetRaster::draw_tet(std::size_t t, RasterSlab& slab) const {
    const Corners c(places_, tets_[t]);
    Eigen::Matrix3d edges;
    for (int e = 0; e < 3; ++e) edges.col(e) = c.x.col(e + 1) - c.x.col(0);
    const double volume = edges.determinant();
    if (!(std::abs(volume) > 1e-12 * edges.colwise().norm().prod())) return;
    const bool inverted =
        (volume < 0) != (grid_.ras_from_voxel.topLeftCorner<3, 3>().determinant() < 0);
    const float scale = rank_scale[inverted][t >= first_class_];

    Eigen::Matrix<double, 4, 3> slope;  // gradient of the weights
    slope.bottomRows<3>() = edges.inverse();
    slope.row(0) = -slope.bottomRows<3>().colwise().sum();
    const Eigen::Vector4d at_origin = Eigen::Vector4d::Unit(0) - slope * c.x.col(0);
    Eigen::Matrix<double, 3, 4> nodal;
    for (int n = 0; n < 4; ++n) nodal.col(n) = values_[tets_[t][n]];
    const Eigen::Vector3f value_step = (nodal * slope.col(0)).cast<float>();

    auto [k, k_end] = whole_numbers(c.low.z(), c.high.z(), grid_.size[2]);
    const auto [j_begin, j_end] = whole_numbers(c.low.y(), c.high.y(), grid_.size[1]);
    for (k = std::max(k, slab.first), k_end = std::min(k_end, slab.last); k < k_end; ++k)
        for (int j = j_begin; j < j_end; ++j) {
            const Eigen::Vector4d at_row = at_origin + slope.col(1) * j + slope.col(2) * k;
            double low = c.low.x(), high = c.high.x();
            for (int n = 0; n < 4; ++n) {
                const double reach = at_row[n] + raster_tolerance, step = slope(n, 0);
                if (step > 0)
                    low = std::max(low, -reach / step);
                else if (step < 0)
                    high = std::min(high, -reach / step);
                else if (reach < 0)
                    high = -1;
            }
            const auto [i_begin, i_end] = whole_numbers(low, high, grid_.size[0]);
            if (i_begin >= i_end) continue;
            const Eigen::Vector3f begin = (nodal * (at_row + slope.col(0) * i_begin)).cast<float>();
            const std::size_t row =
                static_cast<std::size_t>(grid_.size[0]) *
                (j + static_cast<std::size_t>(grid_.size[1]) * (k - slab.first));
            for (int i = i_begin; i < i_end; ++i) {
                const Eigen::Vector3f value = begin + static_cast<float>(i - i_begin) * value_step;
                const float rank = scale * (rank_floor + value.squaredNorm());
                if (rank < slab.ranks[row + i]) {
                    slab.ranks[row + i] = rank;
                    slab.values[row + i] = value;
                }
            }
        }
}

}  // namespace livetet
