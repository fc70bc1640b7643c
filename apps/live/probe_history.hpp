#pragma once

#include <span>

#include "apps/scene/probes.hpp"
#include "io/point_history_csv.hpp"
#include "io/points_csv.hpp"

namespace livetet {

/// Writes the displacements of the scene's probes, frame by frame.
class ProbeHistory {
  public:
    /// Throws Error if the points cannot be read or the file cannot be written.
    ProbeHistory(const ProbeOptions& options, const TetMesh& mesh)
        : points_(read_points_csv(options.points)),
          sampler_(mesh, positions_of(points_)),
          file_(options.displacements, points_) {
        warn_of_points_outside(points_, sampler_.distances());
    }

    /// `displacement`: of each node, m. Throws Error if the disk is full.
    void append(double time_s, std::span<const Vector3> displacement) {
        file_.append(time_s, sampler_.sample(displacement));
    }
    /// The mesh was cut: a probe moves with the side that it is on.
    void set_mesh(const TetMesh& mesh) { sampler_ = PointSampler(mesh, positions_of(points_)); }
    void flush() { file_.flush(); }
    void close() { file_.close(); }

  private:
    std::vector<NamedPoint> points_;
    PointSampler sampler_;
    PointHistoryWriter file_;
};

}  // namespace livetet
