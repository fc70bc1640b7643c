#include "meshing/levels_below.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace livetet {

namespace {

/// For each tet of `coarse` the region of the tet of `fine` that contains, or is nearest to, its
/// centre.
std::vector<std::int32_t> regions_at_centres(const TetMesh& coarse, const TetMesh& fine) {
    std::map<Tet, std::int32_t> region_of_corners;
    const auto sorted = [](Tet t) {
        std::sort(t.begin(), t.end());
        return t;
    };
    for (std::size_t e = 0; e < fine.tets.size(); ++e)
        region_of_corners[sorted(fine.tets[e])] = fine.regions[e];
    std::vector<Vector3> centres;
    for (const Tet& t : coarse.tets)
        centres.push_back(
            (coarse.nodes[t[0]] + coarse.nodes[t[1]] + coarse.nodes[t[2]] + coarse.nodes[t[3]]) /
            4);
    const BarycentricMap map = map_into(fine, centres);
    std::vector<std::int32_t> regions;
    for (const auto& corners : map.nodes) regions.push_back(region_of_corners.at(sorted(corners)));
    return regions;
}

}  // namespace

HierarchyResult levels_below(TetMesh finest, MeshingOptions options,
                             const ProgressCallback& progress) {
    const auto finest_tets = static_cast<double>(finest.tets.size());
    options.target_tets = std::max<std::int64_t>(
        min_tets, std::llround(finest_tets / std::pow(options.coarsening, 3)));
    --options.levels;
    options.body.parts = Parts::all;
    check_options(options);
    HierarchyResult result;
    std::vector<TetMesh> levels;
    try {
        const TriangleMesh boundary{finest.nodes, boundary_triangles(finest.tets)};
        result = build_hierarchy(boundary, options, progress);
        levels = std::move(result.hierarchy.levels);
    } catch (const Error& failure) {  // also of a boundary that cannot be repaired
        result.notes.push_back(fmt::format("no level below that of the file: {}", failure.what()));
    }
    if (!levels.empty() && static_cast<double>(levels.front().tets.size()) >= finest_tets) {
        result.notes.push_back(fmt::format(
            "no level below that of the file: the coarsest that could be made has {} tets",
            levels.front().tets.size()));
        levels.clear();
    }
    if (!finest.regions.empty())
        for (TetMesh& level : levels) level.regions = regions_at_centres(level, finest);
    levels.insert(levels.begin(), std::move(finest));
    result.hierarchy = make_hierarchy(std::move(levels), result.hierarchy.provenance);
    return result;
}

}  // namespace livetet
