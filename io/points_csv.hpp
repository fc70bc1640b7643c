#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// Reads named points from comma-separated text whose first line is `name,x_mm,y_mm,z_mm` (RAS;
/// more columns may follow and are ignored; lines that begin with # are comments). Metres. Throws
/// Error, with the line, where the header is another, a cell is no finite number, a name is there
/// twice, or there is no point.
std::vector<NamedPoint> read_points_csv(const std::filesystem::path& path);

/// Writes points (metres, RAS) for `read_points_csv`.
void write_points_csv(const std::filesystem::path& path, std::span<const NamedPoint> points);

/// Writes points (metres, RAS) and their displacements (metres) as
/// `name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm`; x is the place at rest. Throws Error where the two are
/// not as many.
void write_displacements_csv(const std::filesystem::path& path, std::span<const NamedPoint> points,
                             std::span<const Eigen::Vector3d> displacements);

}  // namespace livetet
