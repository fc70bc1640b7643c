#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulation/scene_run.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// A frame as a result keeps it.
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

/// What a dynamic run that may be killed leaves beside its result, in the folder `RESULT.parts`:
/// every frame that it kept, and the state at its last checkpoint, each file written whole or not
/// at all. By one rank.
class CheckpointStore {
  public:
    /// `about`: what the run depends on, as text.
    CheckpointStore(const std::filesystem::path& result, std::string about);

    /// A new run. Throws Error where an earlier one can go on.
    void begin() const;
    /// Where an earlier run can go on from. Throws Error where there is none, or it was of another
    /// scene or mesh.
    std::pair<RunPlace, BodySnapshot> read() const;

    void keep(std::size_t number, const ResultFrame& frame) const;
    void write(const RunPlace& place, const BodySnapshot& state) const;
    /// A frame that was kept; by `check_frames` it is known to be sound.
    ResultFrame frame(std::size_t number) const;
    /// Throws Error, naming the first, where files of the first `count` frames are damaged or gone.
    void check_frames(std::size_t count) const;
    /// The result is whole, and the folder not needed any more.
    void remove() const;

  private:
    std::filesystem::path frame_file(std::size_t number) const;
    std::filesystem::path result_, folder_;
    std::string about_;
};

}  // namespace livetet
