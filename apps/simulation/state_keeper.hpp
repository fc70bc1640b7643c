#pragma once

#include <optional>
#include <string>

#include "apps/simulation/checkpoint.hpp"
#include "apps/simulation/scene_run.hpp"

namespace livetet {

/// Whether a run begins at the scene's start, or at the last checkpoint of an earlier run.
enum class RunStart { anew, from_checkpoint };

/// Keeps the states of a run: in the result as they come or, where the run may be restarted, as
/// files of the first rank that `close` puts into the result. All functions are collective.
class StateKeeper {
  public:
    /// Begins the result. `tets`: the number of tets of the whole mesh, of which `mesh` and
    /// `share` are this rank's part; they are not kept. Throws Error if the run should write or
    /// read checkpoints and cannot. The scene must outlive this.
    StateKeeper(const Scene& scene, std::size_t tets, const TetMesh& mesh,
                const PartitionedMesh& share, RunStart start);

    /// Of the run of this body on that mesh, which must outlive this. Brings it to where the run
    /// starts. What follows needs the body, but for `frames`, `start_s` and `output_s`.
    RunHooks hooks(DeformableBody& body, ProgressCallback progress);

    /// Completes the result; `description` is the run's (see describe_run). Leaves an older result
    /// alone where no state was reached.
    void close(const std::string& description);
    /// By the first rank, after `close`: removes what a restart would need.
    void remove_checkpoints() const;

    std::size_t frames() const { return frames_; }
    double start_s() const { return start_.time_s; }
    double output_s() const { return output_s_; }
    /// Of the last state that was kept, of this rank's nodes, m, which is gone from here then; the
    /// body's own where none was.
    std::vector<Vector3> take_displacement();

  private:
    void keep(std::size_t number, double time);

    const Scene& scene_;
    DeformableBody* body_ = nullptr;  ///< from `hooks` on
    std::size_t owned_;               ///< nodes of this rank
    RowBlocks nodes_;                 ///< of files
    bool is_first_rank_, keeps_checkpoints_;
    CheckpointStore store_;
    RunPlace start_;
    BodySnapshot restored_;  ///< where the run starts from a checkpoint, until then
    std::optional<ResultWriter> writer_;
    std::optional<std::vector<Vector3>> last_;  ///< displacement that was kept last, m
    std::size_t frames_ = 0;
    double output_s_ = 0;
};

}  // namespace livetet
