#pragma once

#include <filesystem>
#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// Reads Slicer's points: `.mrk.json` (LPS unless it says RAS) or `.fcsv` (both styles). Points
/// that are not placed are skipped; millimetres become metres, LPS becomes RAS. Throws Error, with
/// the point's number and name, where the file is malformed, a coordinate is not finite or no point
/// is left.
std::vector<NamedPoint> read_fiducials(const std::filesystem::path& path);

/// Writes points (metres, RAS) as Slicer writes a point list: `.mrk.json`, LPS, mm. Throws Error
/// where the name has another ending or a coordinate is not finite.
void write_fiducials(const std::filesystem::path& path, const std::vector<NamedPoint>& points);

}  // namespace livetet
