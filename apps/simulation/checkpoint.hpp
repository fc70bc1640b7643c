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
    std::vector<Vector3> displacement;
    struct Field {
        std::string name;
        FieldPlace place;
        int components;
        std::vector<double> values;
    };
    std::vector<Field> fields{};
};

void append_frame(ResultWriter& writer, const ResultFrame& frame);

/// Keeps what a dynamic run needs to be restarted, in the folder `RESULT.parts`: every kept frame,
/// and the state at the last checkpoint. Each file is written completely or not at all. Used by one
/// rank.
class CheckpointStore {
  public:
    /// `about`: text of everything that the run depends on.
    CheckpointStore(const std::filesystem::path& result, std::string about);

    /// Starts a new run. Throws Error if an earlier one can be continued.
    void begin() const;
    /// The last checkpoint. Throws Error if there is none, or it is of another scene or mesh.
    std::pair<RunPlace, BodySnapshot> read() const;

    void keep(std::size_t number, const ResultFrame& frame) const;
    void write(const RunPlace& place, const BodySnapshot& state) const;
    /// Reads a kept frame, sound if `check_frames` has passed.
    ResultFrame frame(std::size_t number) const;
    /// Throws Error, naming the first file, if any of the first `count` frames is damaged or
    /// missing.
    void check_frames(std::size_t count) const;
    /// Removes the folder, once the result is complete.
    void remove() const;

  private:
    std::filesystem::path frame_file(std::size_t number) const;
    std::filesystem::path result_, folder_;
    std::string about_;
};

}  // namespace livetet
