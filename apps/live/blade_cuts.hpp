#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mesh/openable_mesh.hpp"
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
    double longest_s = 0;         ///< longest time that an opening took of a frame
    double prepared_s = 0;        ///< longest time of preparing one, between frames or in one
};

/// Blade paths in the body that were not cut, because they were too long, or took too long, between
/// two samples.
struct BladeGaps {
    std::size_t count = 0;
    double length = 0;  ///< of all together in the body, m
};

/// The levels of four-node tets, or of a grid: without the finest one, if that is of ten-node tets.
std::vector<TetMesh> linear_levels(const std::vector<TetMesh>& levels);

/// Appends the copies of the listed nodes. `first`: number of the first copy; `originals`: of each
/// copy. Lists are sorted before and after.
void add_copies(std::vector<std::int32_t>& nodes, std::size_t first,
                std::span<const std::int32_t> originals);

/// Collects what tracked blades cut of a mesh. It opens together, as opening renews all that
/// depends on the mesh: what is cut within half an interval is prepared in the other half, between
/// frames, and opens an interval after the first of it. Times are those of the samples, so that a
/// replay opens the same cuts in the same frames. To use it:
///
///     follow(...);                          // with each sample
///     if (is_due(t)) opens = begin();
///     open(levels);                         // any time until then
///     keep(), put_off() or undo();          // in the first frame at `opens` or later
class BladeCuts {
  public:
    /// `levels`: linear_levels of the mesh as it was loaded.
    BladeCuts(const std::vector<TetMesh>& levels, double interval_s);

    /// Takes the blades' edges in a sample, in the image, m; none: that blade is not seen. `mesh`
    /// and `displacement`, one a node, m: now. Allocates, if a blade is near the organ.
    void follow(double time_s, std::span<const std::optional<BladeEdge>> edges, const TetMesh& mesh,
                std::span<const Vector3> displacement);
    /// Cuts along a line at once: from each edge straight to the next. Returns false if it parts no
    /// cells. Allocates.
    bool cut_along(double time_s, std::span<const BladeEdge> line, const TetMesh& mesh,
                   std::span<const Vector3> displacement);
    /// From the next frame on, the blades are others: all sweeps begin anew.
    void change_blades() { sweeps_.clear(); }

    /// Whether something was cut that should begin to open now.
    bool is_due(double time_s) const;
    /// Begins to open what was cut so far; what is cut from now on waits for the next opening.
    /// Crumbs stay with a neighbour: a blade that trembles would crumble what it touches. Returns
    /// the time to open at.
    double begin();
    /// The mesh with all that was cut open; `levels`: linear_levels as they are now. May be called
    /// beside `follow`.
    OpenedLevels open(const std::vector<TetMesh>& levels) { return cuttable_->open(levels); }
    /// What was begun has been opened.
    void keep();
    /// What was begun opens no gap: it waits for what is cut next.
    void put_off() { end(); }
    /// Forgets what was begun.
    void undo();
    /// What was begun is to begin once more, together with what was cut since.
    void restart();
    /// Number of pairs of neighbouring cells that were parted.
    std::size_t parted() const { return cuttable_->parted(); }
    /// Gaps so far: those whose straight way has at least a cell's edge in the body.
    const BladeGaps& gaps() const { return gaps_; }
    /// Whether an opening is due or under way.
    bool is_waiting() const { return pending_s_ || begun_s_; }

  private:
    BladeSweep::RestPlace rest_place(const TetMesh& mesh,
                                     std::span<const Vector3> displacement) const;
    bool take(double time_s, const TriangleMesh& swept);
    bool take_now_or_later(double time_s, TriangleMesh swept);
    void end();
    double length_inside(const BladeGap& gap) const;
    void count_gap(const BladeSweep& sweep);
    bool is_near(const BladeEdge& edge, std::span<const Vector3> displacement) const;
    TriangleMesh near_body(const TriangleMesh& swept) const;

    std::unique_ptr<OpenableMesh> cuttable_;
    Vector3 centre_ = Vector3::Zero();  ///< of the mesh's box, m
    double size_ = 0;                   ///< its diagonal, m
    BladeSweepOptions sweep_options_;
    double interval_s_;
    std::vector<BladeSweep> sweeps_;
    BladeGaps gaps_;
    std::optional<double> pending_s_;  ///< when the first of what is to be opened was cut
    std::optional<double> begun_s_;    ///< the same of what is being opened
    /// What blades sweep meanwhile, with its times.
    std::vector<std::pair<double, TriangleMesh>> waiting_;
};

}  // namespace livetet
