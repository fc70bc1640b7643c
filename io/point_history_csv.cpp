#include "io/point_history_csv.hpp"

#include "base/error.hpp"
#include "io/points_csv.hpp"

namespace livetet {

PointHistoryWriter::PointHistoryWriter(const std::filesystem::path& path,
                                       std::span<const NamedPoint> points)
    : path_(path), pending_(path), out_(pending_.path(), std::ios::binary) {
    warn_of_left_parts(path);
    for (const NamedPoint& point : points) points_.push_back(point_csv_row(point));
    out_ << "time_s," << points_csv_header << ",ux_mm,uy_mm,uz_mm\n";
    flush();
}

void PointHistoryWriter::append(double time_s, std::span<const Eigen::Vector3d> displacements) {
    if (displacements.size() != points_.size())
        fail("{}: {} displacements for {} points, expected one each", path_.string(),
             displacements.size(), points_.size());
    std::string text;
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const Eigen::Vector3d mm = 1e3 * displacements[i];
        text += fmt::format("{},{},{},{},{}\n", time_s, points_[i], mm.x(), mm.y(), mm.z());
    }
    out_ << text;
    if (!out_) fail("{}: cannot be written at {} s (is the disk full?)", path_.string(), time_s);
}

void PointHistoryWriter::flush() {
    out_.flush();
    if (!out_) fail("{}: cannot be written (is the disk full?)", path_.string());
}

void PointHistoryWriter::close() {
    out_.close();
    pending_.commit();
}

}  // namespace livetet
