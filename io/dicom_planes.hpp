#pragma once

#include <Eigen/Core>

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "image/image.hpp"

namespace livetet::dicom {

/// Position of a slice or frame in the patient's coordinates (LPS, mm), as the Image Plane module
/// states it (DICOM PS3.3, C.7.6.2).
struct Plane {
    std::string name;                  ///< of the file or frame, for messages
    std::array<int, 2> size{0, 0};     ///< columns, rows
    Eigen::Vector3d position;          ///< centre of the first pixel
    Eigen::Vector3d row, column;       ///< unit vectors along a row and along a column
    Eigen::Vector2d spacing{0, 0};     ///< between the pixels of a row, and those of a column
    std::optional<double> slice_step;  ///< Spacing Between Slices, if stated
    std::optional<double> thickness;   ///< Slice Thickness, if stated
};

/// Grid of stacked planes, and the slice (k) of each plane. The k axis runs from the
/// lowest to the highest position along row x column.
struct Stack {
    ImageGrid grid;
    std::vector<int> slice_of_plane;
};

/// Centre of the first voxel of slice k of a grid, in the patient's coordinates (LPS, mm).
Eigen::Vector3d lps_mm(const ImageGrid& grid, int k);

/// Throws Error unless a plane has finite numbers, positive spacings, and directions that are unit
/// vectors at right angles; corrects rounding of the directions.
void check_plane(Plane& plane);

/// Stacks the slices of an image, in any order. `where`: the series, for messages. Throws Error,
/// naming the plane, if planes differ in size, spacing or orientation, lie at the same position,
/// are shifted along their own directions (gantry tilt), leave a gap or are unevenly spaced. One
/// plane alone must state its Spacing Between Slices or its Slice Thickness.
Stack stack_image(std::span<const Plane> planes, const std::string& where);

/// Stacks the frames of a segmentation: several may lie at one position, and slices without a
/// segment may be missing. The step is the Spacing Between Slices that the planes state, or the
/// smallest gap between two frames, whichever is smaller.
Stack stack_segmentation(std::span<const Plane> planes, const std::string& where);

}  // namespace livetet::dicom
