#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// The ends of a blade's edge, m.
using BladeEdge = std::array<Vector3, 2>;

/// What counts as one sweep of a blade.
struct BladeSweepOptions {
    double longest_edge = 0.001;  ///< of the triangles, m: half a cell
    double longest_step = 0.02;   ///< of the blade's ends between two samples, m
    /// Between two samples in which the blade is seen: with samples between them in which it is
    /// not, and without, where none came. A pose estimator takes any pose after the latter.
    double longest_gap_s = 0.25, longest_miss_s = 0.5;
};

/// A path of a blade between two samples that was too long, or took too long, to be cut.
struct BladeGap {
    double length = 0;                   ///< of the ends of the blade, in the image, m
    std::vector<Vector3> before, after;  ///< rest places along the blade where it was seen, m
};

/// Turns the edge of a blade, sample by sample, into the surface that it sweeps in the organ at
/// rest.
///
/// Points along the edge are carried to their rest places in each sample. A sample's points and
/// those of the one before span the surface. Both samples' surfaces have the points between them in
/// common, to the bit, so that no hole is left. A gap in time or a jump of the blade, in the image
/// or at rest, begins a new sweep: nothing is cut in between, and `gap` tells of it.
class BladeSweep {
  public:
    /// The rest place of a point of the image, m.
    using RestPlace = std::function<Vector3(const Vector3&)>;

    explicit BladeSweep(const BladeSweepOptions& options) : options_(options) {}

    /// The surface swept since the last sample in which the blade was seen; empty in the first one
    /// of a sweep. `edge`: in the image; none: the blade is not seen. At most 256 points a sample
    /// are carried to rest, and the surface has at most 32,640 triangles.
    const TriangleMesh& follow(double time_s, const std::optional<BladeEdge>& edge,
                               const RestPlace& rest_place);

    /// Forgets where the blade was.
    void restart() { last_.reset(); }

    /// What the last sample began a new sweep after; none: it went on, or knew no earlier one.
    const std::optional<BladeGap>& gap() const { return gap_; }

  private:
    struct Seen {
        double time_s = 0;
        BladeEdge edge;             ///< in the image, m
        std::vector<Vector3> rest;  ///< rest places of points along it, m
    };
    bool continues(const Seen& now) const;
    void span(const std::vector<Vector3>& from, const std::vector<Vector3>& to);

    BladeSweepOptions options_;
    std::optional<Seen> last_;
    bool was_unseen_ = false;  ///< in a sample since last_
    std::optional<BladeGap> gap_;
    TriangleMesh surface_;
};

}  // namespace livetet
