#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulation/scene_run.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// A frame of a result.
struct ResultFrame {
    double time_s = 0;
    std::vector<Vector3> displacement;  ///< of this rank's share of the rows (see row_range)
    struct Field {
        std::string name;
        FieldPlace place;
        int components;
        std::vector<double> values;  ///< of this rank's share of the rows (see row_range)
    };
    std::vector<Field> fields{};
};

void append_frame(ResultWriter& writer, const ResultFrame& frame);

/// Keeps what a dynamic run needs to be restarted, in the folder `RESULT.parts`: every kept frame,
/// and the state at the last checkpoint. Each file is written completely or not at all, by all
/// ranks together, and is the same for any number of them.
class CheckpointStore {
  public:
    /// `about`: text of everything that the run depends on; `nodes`, `tets`: of the whole mesh.
    CheckpointStore(const std::filesystem::path& result, std::string about, std::size_t nodes,
                    std::size_t tets);

    /// Starts a new run; by one rank. Throws Error if an earlier one can be continued.
    void begin() const;
    /// The last checkpoint, this rank's block of it. Throws Error if there is none, or it is of
    /// another scene or mesh. Collective.
    std::pair<RunPlace, BodySnapshot> read() const;

    /// Collective, as `write` is.
    void keep(std::size_t number, const ResultFrame& frame) const;
    void write(const RunPlace& place, const BodySnapshot& state) const;
    /// Reads a kept frame, sound if `check_frames` has passed.
    ResultFrame frame(std::size_t number) const;
    /// Throws Error, naming the first file, if any of the first `count` frames is damaged or
    /// missing; by one rank.
    void check_frames(std::size_t count) const;
    /// Removes the folder, once the result is complete; by one rank.
    void remove() const;

  private:
    std::filesystem::path frame_file(std::size_t number) const;
    std::filesystem::path result_, folder_;
    std::string about_;
    std::size_t nodes_, tets_;
};

}  // namespace livetet
