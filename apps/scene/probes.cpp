#include "apps/scene/probes.hpp"

#include <fmt/format.h>

#include "base/log.hpp"
#include "io/points_csv.hpp"

namespace livetet {

Probes::Probes(const ProbeOptions& options, const TetMesh& mesh)
    : points(read_points_csv(options.points)), sampler(mesh, positions_of(points)) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (sampler.distance(i) > 1e-3)
            log_warning(fmt::format(
                "probe {} is {:.1f} mm outside the mesh; its nearest surface point is used",
                points[i].name, 1e3 * sampler.distance(i)));
}

}  // namespace livetet
