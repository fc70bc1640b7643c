#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lists.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/tet_frame.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Finds the tets of a coarse level that are on the same side of gaps as a node of the finer one.
///
/// Levels that are cut do not open at the same places: each passes a cut's surface by up to 0.3 of
/// its own edges. So the coarse tet that a fine node lies in may belong to the other side. The
/// fine level tells the sides apart. Each coarse tet has a place that is on its side for sure: a
/// mean of its middle and of those of its corners that no gap has doubled, or of the places of its
/// neighbours. It is on the side of a node if fine tets that share faces lead from the node to that
/// place without a detour: the way, from middle to middle, may be twice as long as the straight
/// line, and half a coarse edge more. So it may go round a gap's end, but not through a bridge
/// elsewhere.
///
/// Holds references to both meshes, of four-node tets.
class SideFinder {
  public:
    /// O(n log n). `in_fine`: of the fine mesh; needed here alone.
    SideFinder(const TetMesh& fine, const PointLocator& in_fine, const TetMesh& coarse);

    /// Whether a node of the coarse mesh is doubled.
    bool knows_gaps() const { return knows_gaps_; }
    /// Whether a coarse tet is so near to a gap that it may be on the other side of nodes in it: a
    /// corner of it, or of a tet with a corner in common, is doubled. Only where it knows_gaps.
    bool is_near_gap(const Tet& coarse_tet) const;
    /// `found`, a coarse tet near a gap, if it is on the side of the fine node; else the tet there
    /// that holds the node or comes nearest to it. Its `tet` is -1 if there is none within twice
    /// the longest edge of `found`. Its weights are those of the node, of any sign.
    HoldingTet tet_beside(std::int32_t node, std::int32_t found);

  private:
    bool sees(std::int32_t at, std::int32_t coarse_tet) const;
    void forget_hidden_places(std::span<const std::array<std::int32_t, 4>> across);
    HoldingTet best_reached(std::int32_t node, std::int32_t found);
    void reach(std::int32_t tet, double length);

    struct Reached {
        double length;  ///< of the way from the node, m
        std::int32_t tet;
        bool operator>(const Reached& other) const { return length > other.length; }
    };

    const TetMesh& fine_;
    const TetMesh& coarse_;
    bool knows_gaps_ = false;
    std::vector<std::uint8_t> is_near_;  ///< of each coarse node; see is_near_gap
    std::vector<Vector3> places_;        ///< of each coarse tet, on its side, m
    std::vector<std::int32_t> tet_at_;   ///< the fine tets that hold these places;
                                         ///< -1 for coarse tets that are far from gaps
    Lists places_in_;                    ///< the same from the fine tets
    std::vector<std::array<std::int32_t, 4>> across_;  ///< the fine tets behind each face; or -1
    std::vector<Vector3> middles_;                     ///< of the fine tets, m
    Lists around_;                                     ///< of each fine node: its tets
    // Of one search; kept so that it allocates nothing.
    std::vector<double> length_;       ///< of the way to each fine tet, m; infinite: not reached
    std::vector<std::int32_t> known_;  ///< the tets that have one
    std::vector<Reached> front_;       ///< a heap: the nearest first
};

}  // namespace livetet
