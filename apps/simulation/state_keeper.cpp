#include "apps/simulation/state_keeper.hpp"

#include <tuple>
#include <utility>

#include "apps/scene/scene_files.hpp"
#include "apps/simulation/mesh_rows.hpp"
#include "apps/simulation/result_fields.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "io/vector_table.hpp"
#include "solvers/parallel/first_rank.hpp"

namespace livetet {

namespace {

/// Whether the run writes checkpoints. Throws Error if it should but cannot.
bool keeps_checkpoints(const Scene& scene, RunStart start) {
    const bool restarts = start == RunStart::from_checkpoint;
    const bool keeps = scene.time.is_dynamic() && (scene.output.checkpoint_every > 0 || restarts);
    if (keeps && !scene.output.has_file())
        fail("output.file = none: checkpoints end up in this file, expected a name");
    if (restarts && !scene.time.is_dynamic())
        fail("--restart: the scene is static, expected a dynamic one with checkpoints");
    return keeps;
}

/// What a restarted run must have in common with its first part. Collective.
std::string run_identity(const Scene& scene, bool keeps) {
    Scene of_results = scene;
    of_results.output.checkpoint_every = 0;  // may change at a restart
    std::string identity = to_yaml(of_results);
    if (keeps) {
        std::string stamps;
        on_first_rank([&] { stamps = stamps_of(mesh_files(scene)); });
        identity += same_on_all(std::move(stamps));
    }
    return identity;
}

bool is_first_rank() {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    return rank == 0;
}

}  // namespace

StateKeeper::StateKeeper(const Scene& scene, std::size_t tets, const TetMesh& mesh,
                         const PartitionedMesh& share, RunStart start)
    : scene_(scene),
      owned_(static_cast<std::size_t>(share.owned)),
      nodes_(node_blocks(share)),
      is_first_rank_(is_first_rank()),
      keeps_checkpoints_(keeps_checkpoints(scene, start)),
      store_(scene.output.file, run_identity(scene, keeps_checkpoints_), share.total, tets) {
    if (start == RunStart::from_checkpoint) {
        std::tie(start_, restored_) = store_.read();
    } else if (keeps_checkpoints_ && is_first_rank_) {
        store_.begin();
    }
    frames_ = start_.frames;
    if (!scene.output.has_file()) return;
    const auto begin = [&](const TetMesh& rows) {
        writer_.emplace(scene.output.file, rows, to_yaml(scene), Precision::full, PETSC_COMM_WORLD);
    };
    if (share.ranks == 1)
        begin(mesh);
    else
        begin(rows_of_file(mesh, share, tets));
}

RunHooks StateKeeper::hooks(DeformableBody& body, ProgressCallback progress) {
    body_ = &body;
    if (restored_.node_count > 0) body.set_state(std::exchange(restored_, {}));
    RunHooks hooks{.progress = std::move(progress), .start = start_};
    hooks.keep = [this](std::size_t number, double time) { keep(number, time); };
    if (scene_.output.checkpoint_every > 0)
        hooks.checkpoint = [this](const RunPlace& place) {
            store_.write(place, body_->gather_state());
        };
    return hooks;
}

void StateKeeper::close(const std::string& description) {
    const auto began = std::chrono::steady_clock::now();
    if (keeps_checkpoints_) {
        on_first_rank([&] { store_.check_frames(frames_); });
        for (std::size_t k = 0; k < frames_; ++k) append_frame(*writer_, store_.frame(k));
    }
    if (writer_ && frames_ > 0) {
        writer_->write_text("solve", same_on_all(description));
        writer_->close();
    }
    output_s_ += seconds_since(began);
}

void StateKeeper::remove_checkpoints() const {
    if (keeps_checkpoints_) store_.remove();
}

std::vector<Vector3> StateKeeper::take_displacement() {
    return last_ ? std::move(*last_) : body_->displacement();
}

void StateKeeper::keep(std::size_t number, double time) {
    const auto began = std::chrono::steady_clock::now();
    if (!last_) last_.emplace();
    body_->displacement(*last_);
    frames_ = number + 1;
    if (!writer_) return;
    const auto own = flat(*last_).first(3 * owned_);
    const ResultFrame frame{time, vectors_of(nodes_.to_block(own, 3)),
                            result_fields(scene_, *body_)};
    if (!keeps_checkpoints_)
        append_frame(*writer_, frame);
    else
        store_.keep(number, frame);
    output_s_ += seconds_since(began);
}

}  // namespace livetet
