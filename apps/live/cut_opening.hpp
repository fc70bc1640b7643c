#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/blade_cuts.hpp"
#include "apps/live/error_statement.hpp"
#include "apps/live/listed_scene.hpp"
#include "apps/scene/body_factory.hpp"
#include "base/sliced_task.hpp"

namespace livetet {

/// What an opening begins with. All of it must outlive the opening; meshes, lists and places stay
/// as they are.
struct UncutBody {
    const SceneBody& body;
    const Scene& listed;                 ///< see listed_scene
    std::shared_ptr<const CutMesh> cut;  ///< null: it was not cut before
    const ErrorStatement* statement;     ///< null: no errors are stated
    const TargetResponses* for_slips;    ///< null: slips are not judged by responses
};

/// A body at rest on the mesh with a cut open, and what else depends on the mesh.
struct CutBody {
    OpenedNodes nodes;
    std::size_t first = 0;  ///< number of the first copy
    SceneBody body;
    Scene listed;
    std::shared_ptr<CutMesh> cut;  ///< without what is counted once it has opened
    std::vector<MeshPiece> free;   ///< pieces that nothing holds
    std::optional<SceneConstraints> constraints;
    std::vector<std::int32_t> surface;  ///< nodes on it
    std::vector<FixOptions> fix;        ///< see fix_of_responses
    std::optional<ErrorStatement::OnMesh> statement;
    std::optional<TargetResponses> for_slips;
};

/// What holds a cut body in the responses' static solves: there, free pieces need a place, too.
/// `free`: those of the body as it is.
std::vector<FixOptions> fix_of_responses(const Scene& listed, const TetMesh& mesh,
                                         const std::vector<MeshPiece>& free);

/// The opening of what blades have cut: a body on the new mesh, made beside frames of the old one.
class CutOpening {
  public:
    /// `cuts` has begun to open, at `opens_s` of the samples' time, and must outlive this.
    CutOpening(BladeCuts& cuts, UncutBody from, double opens_s);

    double opens_s() const { return opens_s_; }
    /// Prepares it until a pause_point at which `is_over`. Returns whether that is done.
    bool prepare(const std::function<bool()>& is_over);
    /// Prepares what is left, and tells `cuts` what became of it. None: nothing opens; a warning
    /// says why, unless the cut is to wait for more.
    std::unique_ptr<CutBody> finish();
    double prepared_s() const { return prepared_s_; }

  private:
    void make();
    OpenedLevels open_levels() const;
    void make_body_of(CutBody& made, OpenedLevels&& opened) const;

    BladeCuts& cuts_;
    UncutBody from_;
    double opens_s_;
    double prepared_s_ = 0;
    std::unique_ptr<CutBody> made_;  ///< none: the cut opens no gap
    std::string refusal_;            ///< why there is no cut; empty: there is
    SlicedTask task_;                ///< last: ends first
};

}  // namespace livetet
