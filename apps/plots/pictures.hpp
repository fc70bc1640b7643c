#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/plots/virtual_display.hpp"
#include "apps/report/report.hpp"
#include "image/image_markers.hpp"

// Pictures, as PNG files of 1600 x 900 pixels, each written whole or not at all. They are drawn off
// screen, but this needs an X server all the same (see need_display). VTK's own messages go to the
// log.

namespace livetet {

/// The organ at rest and as it was at some moment, `when` ("at 3.20 s"), side by side, seen by the
/// same camera, coloured by displacement in mm; the node sets "fixed" and "patch" of the mesh are
/// marked. `displacement` of each node in metres. Throws Error where its size is not the mesh's or
/// the file cannot be written.
void write_organ_picture(const std::filesystem::path& path, const TetMesh& mesh,
                         std::span<const Vector3> displacement, const std::string& when);

/// RMS error at the moving targets over time, rigid-only and deforming, with the true press depth.
void write_target_error_picture(const std::filesystem::path& path, const TargetErrors& errors);

/// The time that each frame took, against the budget, and how these times are distributed.
void write_frame_times_picture(const std::filesystem::path& path, std::span<const RunFrame> frames,
                               const Report& report);

/// One method's errors against what they took, a point for each mesh.
struct WorkPrecisionLine {
    std::string name;
    std::vector<double> seconds, error;  ///< both above 0
};

/// One chart of error against time, both logarithmic.
struct WorkPrecisionChart {
    std::string title;
    std::string error_axis;
    std::vector<WorkPrecisionLine> lines;
    std::string time_axis = "seconds, set-up and solve";
};

/// Charts side by side.
void write_work_precision_picture(const std::filesystem::path& path,
                                  std::span<const WorkPrecisionChart> charts);

/// One choice: what it costs and what its error is, both above 0.
struct ChoicePoint {
    std::size_t number;
    std::string group, name;
    double x, y;
};

struct ChoicesChart {
    std::string title, x_axis, y_axis;
    std::vector<ChoicePoint> points;
};

/// Error against cost, both logarithmic, with the Pareto front; each point has its number, and
/// beside the chart stands what it is.
void write_choices_picture(const std::filesystem::path& path, const ChoicesChart& chart);

/// Means and their spread against something.
struct SpreadLine {
    std::string name;
    std::vector<double> x, mean, spread;
};

/// One chart of lines with error bars.
struct SpreadChart {
    std::string title, x_axis, y_axis;
    std::vector<SpreadLine> lines;  ///< of the same x, rising
};

/// Charts side by side, with one range of the vertical axis from 0.
void write_spread_picture(const std::filesystem::path& path, std::span<const SpreadChart> charts);

/// What something came to against one thing that varied.
struct ScatterChart {
    std::string x_axis, y_axis;
    std::vector<double> x, y;
    bool logarithmic = false;  ///< x
};

/// Charts in rows, a point for each pair, and a line through the means where values of x come
/// again.
void write_scatter_picture(const std::filesystem::path& path, const std::string& title,
                           std::span<const ScatterChart> charts);

enum class MatrixCell { good, neither, bad };

/// A verdict for each row in each column.
struct MatrixPicture {
    std::string title;
    std::vector<std::array<std::string, 3>> columns;  ///< what they have in common first
    std::vector<std::string> rows;
    std::vector<MatrixCell> cells;  ///< row by row
};

/// The matrix as coloured boxes.
void write_matrix_picture(const std::filesystem::path& path, const MatrixPicture& matrix);

/// Markers found in an image, for a user to confirm: for each a slice through the whole image and,
/// enlarged, the three slices through its centre across z, y and x (RAS), with a cross-hair and a
/// circle of the `diameter` (metres); axes in mm. As many pixels as they need.
void write_marker_picture(const std::filesystem::path& path, const GreyImage& image,
                          std::span<const ImageMarker> markers, double diameter);

/// A file's bytes as base64, to stand in a page.
std::string base64_of(const std::filesystem::path& path);

}  // namespace livetet
