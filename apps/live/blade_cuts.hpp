#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mesh/hex_cut.hpp"
#include "mesh/rest_places.hpp"
#include "tracking/blade_sweep.hpp"

namespace livetet {

/// The mesh as blades have cut it so far.
struct CutMesh {
    TetMesh mesh;
    /// Of each node after those of the mesh as it was loaded: the node that it is a copy of, with a
    /// lower number.
    std::vector<std::int32_t> originals;
    std::size_t openings = 0;     ///< how often nodes were doubled
    std::size_t parted = 0;       ///< pairs of neighbouring cells that blades have parted
    std::size_t pieces = 1;       ///< of the body
    std::size_t free_pieces = 0;  ///< of these, not held by fix or drive
    double longest_s = 0;         ///< longest time that an opening took
};

/// Appends the copies of the listed nodes. `first`: number of the first copy; `originals`: of each
/// copy. Lists are sorted before and after.
void add_copies(std::vector<std::int32_t>& nodes, std::size_t first,
                std::span<const std::int32_t> originals);
/// Appends to one value a node those of the copies.
template <class Value>
void copy_values(std::vector<Value>& values, std::span<const std::int32_t> originals) {
    for (const std::int32_t n : originals) values.push_back(Value(values[n]));
}

/// Collects what tracked blades cut of a grid. It opens together, an interval after the first of
/// it, as opening renews all that depends on the mesh. Times are those of the samples, so that a
/// replay opens the same cuts in the same frames.
class BladeCuts {
  public:
    /// `mesh`: as it was loaded, a grid.
    BladeCuts(const TetMesh& mesh, double interval_s);

    /// Takes the blades' edges in a frame, in the image, m; none: that blade is not seen.
    /// `cells` and `displacement`, one a node, m: of the mesh now. Allocates, if a blade is near
    /// the organ.
    void follow(double time_s, std::span<const std::optional<BladeEdge>> edges,
                std::span<const Hexahedron> cells, std::span<const Vector3> displacement);
    /// From the next frame on, the blades are others: all sweeps begin anew.
    void change_blades() { sweeps_.clear(); }

    /// Whether something was cut that should be opened now.
    bool is_due(double time_s) const;
    /// The mesh with all that was cut open; `mesh`: as it is now. Call `keep` or `undo` then.
    /// Single cells that were cut off since the last `keep` stay with a neighbour: a blade that
    /// trembles would crumble what it touches.
    OpenedGrid open(const TetMesh& mesh);
    /// What was cut so far has been opened, or opens no gap.
    void keep();
    /// Forgets what was cut since the last `keep`.
    void undo();
    /// Number of links that were cut.
    std::size_t parted() const;

  private:
    bool is_near(const BladeEdge& edge, std::span<const Vector3> displacement) const;
    TriangleMesh near_grid(const TriangleMesh& swept) const;
    void rejoin_single_cells();

    HexLevel level_;  ///< as loaded
    GridFrame frame_;
    LinkCrossings crossings_;
    RestPlaces rest_places_;
    Vector3 centre_ = Vector3::Zero();  ///< of the grid's box, m
    double size_ = 0;                   ///< its diagonal, m
    BladeSweepOptions sweep_options_;
    double interval_s_;
    std::vector<BladeSweep> sweeps_;
    std::vector<std::uint8_t> cut_, kept_;  ///< one a link of level_
    std::optional<double> pending_s_;       ///< when the first of what is not kept was cut
};

}  // namespace livetet
