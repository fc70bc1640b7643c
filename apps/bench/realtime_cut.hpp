#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

#include "base/distribution.hpp"
#include "base/progress.hpp"

namespace livetet {

/// When an opening is prepared.
enum class Preparation { between_frames, in_a_frame };

/// Frames of a body that a blade cuts without a pause, on one kind of element.
struct CutRow {
    std::string elements;
    Preparation preparation = Preparation::between_frames;
    std::size_t cells = 0;
    double faces_a_frame = 0;  ///< pairs of cells that are parted, mean over frames of cutting
    std::size_t openings = 0;
    double prepared_s = 0;  ///< longest preparation of one
    Distribution all{};     ///< from a sample's arrival to the end of its frame, s
    Distribution opened{};  ///< the same of frames in which a cut opened
    std::size_t late = 0;   ///< frames of all that took longer than the deadline

    /// A cut keeps the deadline in 99 % of the frames, if it is prepared between them.
    bool meets_target() const {
        return preparation == Preparation::in_a_frame || 100 * late <= all.count;
    }
};

/// Time for a frame, from its sample's arrival, s.
inline constexpr double cut_deadline_s = 0.04;

/// A block of 200 x 100 x 100 mm in 60,000 hexahedra or tets of four nodes, or 6,000 of ten,
/// neo-Hookean, pressed at one end; a blade cuts down to 0.7 of the height, plane after plane.
/// Fifteen samples a second, in real time. `frames`: of each row.
std::vector<CutRow> measure_cuts(int frames, int threads, ProgressLine& progress);

void print_cuts(const std::vector<CutRow>& rows);
nlohmann::json json_of(const std::vector<CutRow>& rows);

}  // namespace livetet
