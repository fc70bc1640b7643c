#include "apps/scene/targets.hpp"

#include <algorithm>
#include <limits>

#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "io/points_csv.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

std::vector<Vector3> spread_places(const TetMesh& mesh, const std::vector<std::int32_t>& nodes,
                                   std::size_t max_places) {
    Vector3 mean = Vector3::Zero();
    for (const std::int32_t n : nodes) mean += mesh.nodes[n] / static_cast<double>(nodes.size());
    std::vector<double> distance(nodes.size(), std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if ((mesh.nodes[nodes[i]] - mean).norm() < (mesh.nodes[nodes[next]] - mean).norm())
            next = i;
    std::vector<Vector3> places;
    while (places.size() < std::min(nodes.size(), max_places)) {
        places.push_back(mesh.nodes[nodes[next]]);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            distance[i] = std::min(distance[i], (mesh.nodes[nodes[i]] - places.back()).norm());
        next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) -
                                        distance.begin());
    }
    return places;
}

std::vector<Vector3> surface_places(const TetMesh& mesh) {
    return spread_places(mesh, surface_nodes(mesh), max_places_of_surface);
}

namespace {

void check_inside(const std::vector<Target>& targets, std::string_view list, const TetMesh& mesh) {
    constexpr double farthest = 1e-3;
    std::vector<Vector3> places;
    for (const Target& t : targets) places.push_back(t.places.front());
    const BarycentricMap map = map_into(mesh, places);
    for (std::size_t i = 0; i < targets.size(); ++i)
        if (map.distance[i] > farthest)
            fail(
                "{}: {} at ({:.1f}, {:.1f}, {:.1f}) mm is {:.1f} mm outside the mesh, "
                "expected a place in the organ",
                list, targets[i].name, 1e3 * places[i].x(), 1e3 * places[i].y(),
                1e3 * places[i].z(), 1e3 * map.distance[i]);
}

}  // namespace

std::vector<Target> read_targets(const Scene& scene, const TetMesh& mesh) {
    return read_targets(scene.track->targets, "track.targets", mesh);
}

std::vector<Target> read_targets(std::span<const TargetOptions> options, std::string_view list,
                                 const TetMesh& mesh) {
    std::vector<Target> targets;
    const auto add = [&](const std::string& name, std::vector<Vector3> places) {
        if (std::ranges::find(targets, name, &Target::name) != targets.end())
            fail("{}: two targets are called {}, expected names that differ", list, name);
        targets.push_back({name, std::move(places)});
    };
    for (std::size_t i = 0; i < options.size(); ++i) {
        const TargetOptions& t = options[i];
        if (t.point_mm)
            add(t.name, {*t.point_mm / 1e3});
        else if (!t.points.empty())
            for (const NamedPoint& p : read_points_csv(t.points)) add(p.name, {p.position});
        else
            add(t.name, spread_places(mesh, select_nodes(mesh, t, fmt::format("{}[{}]", list, i)),
                                      max_places_of_region));
    }
    if (!targets.empty()) check_inside(targets, list, mesh);
    return targets;
}

std::vector<Target> all_targets(const Scene& scene, const TetMesh& mesh) {
    std::vector<Target> targets;
    if (scene.track) targets = read_targets(scene, mesh);
    if (!scene.deform) return targets;
    for (Target& t : read_targets(scene.deform->targets, "deform.targets", mesh))
        if (std::ranges::find(targets, t.name, &Target::name) == targets.end())
            targets.push_back(std::move(t));
    return targets;
}

}  // namespace livetet
