#pragma once

#include <cstdint>
#include <vector>

#include "apps/bench/registration_organ.hpp"
#include "apps/simulation/measured_organ.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// An organ, pulled at one place of its surface, farther at each load step: neo-Hookean, of ten
/// nodes a tet. What a model of it does not know.
struct PulledOrgan {
    TetMesh mesh;
    std::vector<std::vector<Vector3>> displacements;  ///< at each load step, m
    Vector3 place;                                    ///< about which it is pulled, m
    Vector3 below, up;                                ///< of BenchOrgan: its lower side
    std::vector<NamedPoint> targets;                  ///< at rest
    std::vector<std::vector<Vector3>> moved;          ///< the targets at each load step
    /// RMS motion of the targets at a load step, m.
    double target_rms(std::size_t step) const;
    /// The load step at which the targets have moved nearest to this RMS.
    std::size_t step_of(double rms_m) const;
    double largest(std::size_t step) const;
};

/// Place and direction of the pull are drawn by `seed`. The
/// targets move by about `max_rms_m` at the last load step. Needs a PetscSession. Throws Error if
/// the body does not come to rest at any.
PulledOrgan pull_organ(const BenchOrgan& from, int tets, std::uint64_t seed, double max_rms_m,
                       const ProgressCallback& progress);

/// How an organ's surface is measured.
struct SurfaceSweep {
    double coverage = 0.3;   ///< share of the surface's area, about where the organ is pulled
    double noise_m = 0.001;  ///< of a point along each axis, one standard deviation
    double outliers = 0;     ///< share of points that are 10 to 40 mm off
    std::size_t points = 300;
    std::uint64_t seed = 1;
};

/// Points of the deformed surface, spread over a part of it.
std::vector<Vector3> sweep_surface(const PulledOrgan& organ, std::size_t step,
                                   const SurfaceSweep& sweep);

}  // namespace livetet
