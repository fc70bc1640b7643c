#pragma once

#include <span>

#include "apps/scene/probes.hpp"
#include "io/point_history_csv.hpp"

namespace livetet {

/// Writes the displacements of the scene's probes, frame by frame.
class ProbeHistory {
  public:
    /// Throws Error if the points cannot be read or the file cannot be written.
    ProbeHistory(const ProbeOptions& options, const TetMesh& mesh)
        : probes_(options, mesh), file_(options.displacements, probes_.points) {}

    /// `displacement`: of each node, m. Throws Error if the disk is full.
    void append(double time_s, std::span<const Vector3> displacement) {
        file_.append(time_s, probes_.sampler.sample(displacement));
    }
    /// The mesh was cut: a probe moves with the side that it is on.
    void set_mesh(const TetMesh& mesh) {
        probes_.sampler = PointSampler(mesh, positions_of(probes_.points));
    }
    void flush() { file_.flush(); }
    void close() { file_.close(); }

  private:
    Probes probes_;
    PointHistoryWriter file_;
};

}  // namespace livetet
