#pragma once

#include <atomic>
#include <limits>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Rank of a voxel that no tet covers.
inline constexpr float uncovered = std::numeric_limits<float>::infinity();

/// Ranks from here on belong to inverted tets.
inline constexpr float inverted_rank = 1e13F;

/// A range of slices with the rasterised nodal vector field and the rank of each voxel, i fastest.
/// If several tets cover a voxel, the one with the lowest rank counts.
struct RasterSlab {
    int first = 0, last = 0;              ///< slices k of [first, last)
    std::vector<Eigen::Vector3f> values;  ///< metres; undefined in uncovered voxels
    std::vector<float> ranks;             ///< `uncovered` if there is no tet

    /// Sets the range to slices [first, last) and marks all voxels as uncovered.
    void clear(int first, int last, std::size_t voxels_a_slice);
};

/// Rasterises a linear nodal vector field on tets into the voxels of a grid. A voxel is covered if
/// its centre is in the tet or on its boundary. The rows of voxels in each tet are computed
/// directly; nothing is searched.
///
/// A voxel may be covered several times: on a face between two tets, where both have the same
/// value, and where the body overlaps itself. Upright tets then win over inverted ones, tets of the
/// first class over those of the second, and the shorter vector over the longer one (the tissue
/// that moved less). The result does not depend on the order of the tets.
///
/// Order of use: construct; then, in each thread, `make_slab` once and `draw` for each of the
/// `slab_count` slabs.
class TetRaster {
  public:
    /// `nodes`: positions, metres, RAS. `values`: nodal vectors, metres, at most 100 m long. Tets
    /// before index `first_class` are of the first class, the rest of the second. A tet is inverted
    /// if it is not wound as in TetMesh; tets without volume cover nothing. Keeps references to
    /// `tets` and `values`. Precondition: all numbers are finite.
    TetRaster(const ImageGrid& grid, std::span<const Tet> tets, std::size_t first_class,
              std::span<const Vector3> nodes, std::span<const Vector3> values);

    int slab_count() const { return static_cast<int>(first_.size()) - 1; }
    /// A slab with room for any slab of this raster.
    RasterSlab make_slab() const;
    /// Clears `slab` and draws slab number `s` into it. Allocates nothing. Threads may call it
    /// concurrently, each with its own slab.
    void draw(int s, RasterSlab& slab) const;

  private:
    void draw_tet(std::size_t t, RasterSlab& slab) const;
    std::size_t voxels_a_slice() const {
        return static_cast<std::size_t>(grid_.size[0]) * grid_.size[1];
    }

    ImageGrid grid_;
    std::span<const Tet> tets_;
    std::size_t first_class_;
    std::span<const Vector3> values_;
    std::vector<Vector3> places_;  ///< node positions, voxel coordinates
    /// Tets of slab s: list_[first_[s]] to list_[first_[s + 1] - 1].
    std::vector<std::int32_t> first_, list_;
};

/// Calls work(slab number, thread) for each slab on all threads; each thread takes the next free
/// slab.
template <class Work>
void for_each_slab(ThreadTeam& team, int slabs, Work&& work) {
    std::atomic<int> next{0};
    team.run([&](int thread) {
        for (int s; (s = next.fetch_add(1)) < slabs;) work(s, thread);
    });
}

}  // namespace livetet
