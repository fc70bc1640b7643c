#pragma once

#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "base/file.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Writes the displacements of points over time, a line for each point and frame:
/// `time_s,name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm`. `close` moves the file to its final name;
/// without it nothing is left behind, except where the program is killed: the file
/// `.NAME.partPID.csv` then has everything up to the last `flush`.
class PointHistoryWriter {
  public:
    /// Throws Error if the file cannot be written.
    PointHistoryWriter(const std::filesystem::path& path, std::span<const NamedPoint> points);

    /// Appends a frame: one displacement (m) a point. Throws Error if their number is wrong or the
    /// disk is full; `close` can still save the frames before.
    void append(double time_s, std::span<const Eigen::Vector3d> displacements);
    void flush();
    void close();

  private:
    std::filesystem::path path_;
    std::vector<std::string> points_;  ///< name and rest position of each, as in its lines
    PendingFile pending_;
    std::ofstream out_;
};

}  // namespace livetet
