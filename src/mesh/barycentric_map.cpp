#include "mesh/barycentric_map.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/error.hpp"
#include "base/sliced_task.hpp"
#include "base/thread_team.hpp"
#include "mesh/point_locator.hpp"
#include "mesh/tet_frame.hpp"
#include "mesh/tet_weights.hpp"

namespace livetet {

BarycentricMap map_into(const TetMesh& mesh, std::span<const Vector3> points, Outside outside) {
    const PointLocator locator(mesh);
    pause_point();
    BarycentricMap map;
    map.nodes.resize(points.size());
    map.weights.resize(points.size());
    map.distance.assign(points.size(), 0.0);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite())
            fail("barycentric map: point {} has a coordinate that is not finite", i);
    ThreadTeam team(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
    constexpr std::size_t worth_a_thread = 10000;
    team.run_pieces(points.size(), worth_a_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const PointLocator::Hit hit = locator.find(points[i]);
            map.nodes[i] = hit.corners;
            map.weights[i] = hit.weights;
            map.distance[i] = hit.distance;
            if (hit.distance > 0 && outside == Outside::extrapolated)
                map.weights[i] =
                    extrapolated_weights(hit.weights, weights_in(mesh, hit.corners, points[i]));
        }
    });
    return map;
}

std::array<double, 4> weights_in(const TetMesh& mesh, const Tet& t, const Vector3& x) {
    return frame_of(mesh, t).weights(x);
}

Vector3 interpolate(const BarycentricMap& map, std::size_t point, std::span<const Vector3> values) {
    const auto& n = map.nodes[point];
    const auto& w = map.weights[point];
    return w[0] * values[n[0]] + w[1] * values[n[1]] + w[2] * values[n[2]] + w[3] * values[n[3]];
}

}  // namespace livetet
