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

// Pictures as PNG files of 1600 x 900 pixels, each written completely or not at all. They are drawn
// off screen, which still needs an X server (see need_display). VTK's messages go to the log.

namespace livetet {

/// The organ at rest and at a time `when` ("at 3.20 s") side by side, with the same camera,
/// coloured by displacement in mm; the node sets "fixed" and "patch" of the mesh are marked.
/// `displacement`: of each node, m. Throws Error if its size is wrong or the file cannot be
/// written.
void write_organ_picture(const std::filesystem::path& path, const TetMesh& mesh,
                         std::span<const Vector3> displacement, const std::string& when);

/// RMS error at the moving targets over time, rigid-only and deforming, with the true depth of the
/// press.
void write_target_error_picture(const std::filesystem::path& path, const TargetErrors& errors);

/// The time of each frame against the budget, and the distribution of these times.
void write_frame_times_picture(const std::filesystem::path& path, std::span<const RunFrame> frames,
                               const Report& report);

/// Errors of a method against its times, a point for each mesh.
struct WorkPrecisionLine {
    std::string name;
    std::vector<double> seconds, error;  ///< both above 0
    /// Lines of a group have one colour, all but the first dotted; empty: a colour of its own.
    std::string group{};
};

/// A chart of error against time, both logarithmic.
struct WorkPrecisionChart {
    std::string title;
    std::string error_axis;
    std::vector<WorkPrecisionLine> lines;
    std::string time_axis = "seconds, set-up and solve";
    std::string front{};  ///< name of the Pareto front, which is drawn; empty: it is not
};

/// Charts side by side. A front is a dashed line through its points, which are ringed.
void write_work_precision_picture(const std::filesystem::path& path,
                                  std::span<const WorkPrecisionChart> charts);

/// Cost and error of a choice, both above 0.
struct ChoicePoint {
    std::size_t number;
    std::string group, name;
    double x, y;
};

struct ChoicesChart {
    std::string title, x_axis, y_axis;
    std::vector<ChoicePoint> points;
};

/// Error against cost, both logarithmic, with the Pareto front and a numbered legend of the points.
void write_choices_picture(const std::filesystem::path& path, const ChoicesChart& chart);

/// Means and their spread.
struct SpreadLine {
    std::string name;
    std::vector<double> x, mean, spread;
};

/// A chart of lines with error bars.
struct SpreadChart {
    std::string title, x_axis, y_axis;
    std::vector<SpreadLine> lines;  ///< with the same x, rising
};

/// Charts side by side, with one range of the vertical axis from 0.
void write_spread_picture(const std::filesystem::path& path, std::span<const SpreadChart> charts);

/// An output against an input.
struct ScatterChart {
    std::string x_axis, y_axis;
    std::vector<double> x{}, y{};
    bool logarithmic = false;  ///< x
    /// What the colours mean: the name of another input, and names of groups of its values, in
    /// order. No groups: all points have one colour.
    std::string colour_axis{};
    std::vector<std::string> groups{};
    std::vector<std::size_t> group_of{};  ///< of each point, index in groups
};

/// Charts in rows: a point for each pair, coloured by its group, and a line through the means where
/// values of x repeat.
void write_scatter_picture(const std::filesystem::path& path, const std::string& title,
                           std::span<const ScatterChart> charts);

enum class MatrixCell { good, neither, bad };

/// Verdicts in rows and columns.
struct MatrixPicture {
    std::string title;
    std::vector<std::array<std::string, 3>> columns;  ///< common part first
    std::vector<std::string> rows;
    std::vector<MatrixCell> cells;  ///< row by row
};

/// The matrix as coloured boxes.
void write_matrix_picture(const std::filesystem::path& path, const MatrixPicture& matrix);

/// Markers found in an image, for checking by eye: for each marker a slice through the whole image
/// and, enlarged, three slices through its centre across z, y and x (RAS), with a cross-hair and a
/// circle of the `diameter` (m); axes in mm. The size of the picture depends on their number.
void write_marker_picture(const std::filesystem::path& path, const GreyImage& image,
                          std::span<const ImageMarker> markers, double diameter);

/// Contents of a file as base64, for a page.
std::string base64_of(const std::filesystem::path& path);

}  // namespace livetet
