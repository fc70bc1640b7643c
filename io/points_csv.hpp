#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// The first line of a file of points.
inline constexpr std::string_view points_csv_header = "name,x_mm,y_mm,z_mm";

/// A point (metres, RAS) as a line of such a file, without its end.
std::string point_csv_row(const NamedPoint& point);

/// Reads named points (metres, RAS) from comma-separated text whose first line is
/// `name,x_mm,y_mm,z_mm`. Further columns are ignored; lines that begin with # are comments. Throws
/// Error, with the line, if the header differs, a coordinate is not a finite number, a name occurs
/// twice, or there is no point.
std::vector<NamedPoint> read_points_csv(const std::filesystem::path& path);

/// Writes points (metres, RAS) for `read_points_csv`.
void write_points_csv(const std::filesystem::path& path, std::span<const NamedPoint> points);

/// Writes points (rest positions, metres, RAS) and their displacements (metres) as
/// `name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm`. Throws Error if the counts differ.
void write_displacements_csv(const std::filesystem::path& path, std::span<const NamedPoint> points,
                             std::span<const Eigen::Vector3d> displacements);

}  // namespace livetet
