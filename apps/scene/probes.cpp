#include "apps/scene/probes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/log.hpp"
#include "io/points_csv.hpp"
#include "io/vector_table.hpp"

namespace livetet {

namespace {

/// The tets that points are in, or nearest to, as a mesh of their own. `numbers`: its nodes' in the
/// mesh.
TetMesh tets_at(const TetMesh& mesh, std::span<const Vector3> points,
                std::vector<std::int32_t>& numbers) {
    const auto sorted = [](std::array<std::int32_t, 4> t) {
        std::ranges::sort(t);
        return t;
    };
    std::set<std::array<std::int32_t, 4>> wanted;
    for (const auto& corners : map_into(mesh, points).nodes) wanted.insert(sorted(corners));
    TetMesh part;
    std::map<std::int32_t, std::int32_t> number_of;
    const auto take = [&](std::int32_t& n) {
        const auto [at, is_new] =
            number_of.try_emplace(n, static_cast<std::int32_t>(numbers.size()));
        if (is_new) {
            numbers.push_back(n);
            part.nodes.push_back(mesh.nodes[n]);
        }
        n = at->second;
    };
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        if (!wanted.contains(sorted(mesh.tets[e]))) continue;
        std::ranges::for_each(part.tets.emplace_back(mesh.tets[e]), take);
        if (!mesh.edge_nodes.empty())
            std::ranges::for_each(part.edge_nodes.emplace_back(mesh.edge_nodes[e]), take);
    }
    return part;
}

}  // namespace

void warn_of_points_outside(const std::vector<NamedPoint>& points, const PointSampler& sampler) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (sampler.distance(i) > 1e-3)
            log_warning(fmt::format(
                "probe {} is {:.1f} mm outside the mesh; its nearest surface point is used",
                points[i].name, 1e3 * sampler.distance(i)));
}

Probes::Probes(const ProbeOptions& options, const TetMesh& mesh, const PartitionedMesh& share)
    : points_(read_points_csv(options.points)), owned_(share.owned) {
    const std::vector<Vector3> places = positions_of(points_);
    std::vector<std::int32_t> nodes;
    sampler_.emplace(tets_at(mesh, places, nodes), places);
    const std::vector<PetscInt> number_of_node = node_numbers(share);
    int rank = 0;
    MPI_Comm_rank(share.comm, &rank);
    std::vector<PetscInt> used;
    if (rank == 0)
        for (const std::int32_t n : nodes) used.push_back(number_of_node[n]);
    nodes_.emplace(share.comm, static_cast<std::size_t>(share.owned), used);
    if (rank == 0) warn_of_points_outside(points_, *sampler_);
}

std::vector<Vector3> Probes::sample(std::span<const Vector3> local) const {
    const std::vector<Vector3> own(local.begin(), local.begin() + owned_);
    const std::vector<double> of_tets = nodes_->from_owners(flat(own), 3);
    return of_tets.empty() ? std::vector<Vector3>{} : sampler_->sample(vectors_of(of_tets));
}

}  // namespace livetet
