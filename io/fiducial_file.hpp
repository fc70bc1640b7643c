#pragma once

#include <filesystem>
#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// Reads a 3D Slicer point list: `.mrk.json` (LPS unless the file says RAS) or `.fcsv` (both
/// versions). Returns metres, RAS; points that are not placed are skipped. Throws Error, with the
/// point's number and name, if the file is malformed, a coordinate is not finite or no point is
/// left.
std::vector<NamedPoint> read_fiducials(const std::filesystem::path& path);

/// Writes points (metres, RAS) as a 3D Slicer point list: `.mrk.json`, LPS, mm. Throws Error for
/// another file extension or a coordinate that is not finite.
void write_fiducials(const std::filesystem::path& path, const std::vector<NamedPoint>& points);

}  // namespace livetet
