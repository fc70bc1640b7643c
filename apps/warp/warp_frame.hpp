#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <variant>

#include "apps/warp/warp_plan.hpp"
#include "base/thread_team.hpp"
#include "image/image.hpp"
#include "io/result_file.hpp"
#include "io/volume.hpp"

namespace livetet {

/// An image to warp: labels or grey values, and its type in the file.
struct WarpSource {
    std::filesystem::path file;
    std::variant<GreyImage, LabelImage> values;
    ScalarType stored = ScalarType::float32;
    Interpolation how = Interpolation::linear;

    ImageGrid grid() const {
        return std::visit([](const auto& image) { return grid_of(image); }, values);
    }
};

/// A result with the image that is warped by its frames. After construction it may be used by
/// several threads; HDF5, which may not, is called by one at a time.
class WarpInput {
  public:
    /// Throws Error if the result or an image cannot be read, shows another place, or is of a kind
    /// that the outputs cannot be made of.
    WarpInput(const std::filesystem::path& result, const WarpArguments& arguments);

    const std::filesystem::path& file() const { return file_; }
    /// The image; none if only fields are written, on another grid.
    const std::optional<WarpSource>& source() const { return source_; }
    const ImageGrid& grid() const { return grid_; }  ///< of the outputs
    double rind() const { return rind_; }            ///< metres
    double read_s() const { return read_s_; }
    const std::string& note() const { return note_; }  ///< of nodes outside of the image; or empty
    const std::string& cuts() const { return cuts_; }  ///< of the scene (cuts_text); or empty
    double time_s(std::size_t frame) const { return result_->times_s()[frame]; }
    std::size_t frame_count() const { return result_->frame_count(); }
    const TetMesh& mesh() const { return result_->mesh(); }
    std::vector<Vector3> displacement(std::size_t frame) const;

  private:
    std::filesystem::path file_;
    std::shared_ptr<const ResultReader> result_;
    std::optional<WarpSource> source_;
    ImageGrid grid_;
    double rind_ = 0, read_s_ = 0;
    std::string note_, cuts_;
};

/// Result of warping a frame: the figures, and the same as text.
struct WarpedFrame {
    nlohmann::json figures;
    std::string text;
};

/// Warps a frame and writes its files, each whole or not at all.
WarpedFrame warp_frame(const WarpInput& input, const WarpJob& job, const WarpArguments& arguments,
                       ThreadTeam& team);

}  // namespace livetet
