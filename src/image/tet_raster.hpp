#pragma once

#include <atomic>
#include <limits>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Nothing covers this voxel.
inline constexpr float uncovered = std::numeric_limits<float>::infinity();

/// From this rank on it is an inverted tet that covers a voxel.
inline constexpr float inverted_rank = 1e13F;

/// What the tets that cover some whole slices of a grid say there, voxel by voxel, i fastest: the
/// vector field that is given at their nodes, linear in each tet, and its rank. Of several tets
/// over one voxel the one of least rank counts.
struct RasterSlab {
    int first = 0, last = 0;              ///< slices k, `last` not among them
    std::vector<Eigen::Vector3f> values;  ///< metres; anything where nothing covers
    std::vector<float> ranks;             ///< `uncovered` where there is no tet

    /// Slices `first` to before `last` of so many voxels each, nothing covered.
    void clear(int first, int last, std::size_t voxels_a_slice);
};

/// Tets over the voxels of a grid: a voxel is covered where its centre lies in the tet or on its
/// boundary. The tets go to the voxels, by their rows' ends, and not the voxels to the tets:
/// nothing is searched.
///
/// A voxel may be covered twice: on a face between two tets, where both say the same, and where the
/// body overlaps itself. There tets that stand upright win over inverted ones, then tets of the
/// first class over those of the second, and then the shorter vector wins: of tissue over tissue,
/// what moved least. Nothing depends on the order of the tets.
class TetRaster {
  public:
    /// `nodes`: where they lie, metres, RAS; `values`: of each node, metres, up to 100 m. The tets
    /// before `first_class` are of the first class, the rest of the second; one is inverted where
    /// it is not wound as TetMesh says. Tets without volume cover nothing. `tets` and `values` must
    /// outlive the raster. Precondition: all numbers are finite.
    TetRaster(const ImageGrid& grid, std::span<const Tet> tets, std::size_t first_class,
              std::span<const Vector3> nodes, std::span<const Vector3> values);

    int slab_count() const { return static_cast<int>(first_.size()) - 1; }
    /// One with room for any of them.
    RasterSlab make_slab() const;
    /// Slab `s` into one of `make_slab`, which is cleared before. Allocates nothing. May be called
    /// by several threads, each with a slab of its own.
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
    std::vector<Vector3> places_;  ///< of each node, in voxels
    std::vector<std::int32_t> first_,
        list_;  ///< tets of slab s: list_[first_[s]] to before list_[first_[s + 1]]
};

/// work(slab number, thread) for each slab, on all threads, each taking the next when it is through
/// with one.
template <class Work>
void for_each_slab(ThreadTeam& team, int slabs, Work&& work) {
    std::atomic<int> next{0};
    team.run([&](int thread) {
        for (int s; (s = next.fetch_add(1)) < slabs;) work(s, thread);
    });
}

}  // namespace livetet
