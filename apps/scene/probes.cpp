#include "apps/scene/probes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "base/log.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

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

void warn_of_points_outside(const std::vector<NamedPoint>& points,
                            std::span<const double> distances) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (distances[i] > 1e-3)
            log_warning(fmt::format(
                "probe {} is {:.1f} mm outside the mesh; its nearest surface point is used",
                points[i].name, 1e3 * distances[i]));
}

namespace {

/// How far each point is from the whole mesh, and the first rank whose part is as near. Collective.
struct Nearest {
    Nearest(const MeshPart& part, std::span<const Vector3> points)
        : distances(points.size(), std::numeric_limits<double>::infinity()),
          ranks(points.size(), 0) {
        if (!part.mesh().tets.empty()) distances = map_into(part.mesh(), points).distance;
        if (part.comm() == MPI_COMM_SELF) return;
        struct Place {
            double distance;
            int rank;
        };
        int rank = 0;
        MPI_Comm_rank(part.comm(), &rank);
        std::vector<Place> places;
        for (const double d : distances) places.push_back({d, rank});
        MPI_Allreduce(MPI_IN_PLACE, places.data(), static_cast<int>(places.size()), MPI_DOUBLE_INT,
                      MPI_MINLOC, part.comm());
        for (std::size_t i = 0; i < places.size(); ++i) {
            distances[i] = places[i].distance;
            ranks[i] = places[i].rank;
        }
    }
    std::vector<double> distances;  ///< m
    std::vector<int> ranks;
};

}  // namespace

Probes::Probes(std::vector<NamedPoint> points, const MeshPart& part)
    : points_(std::move(points)), comm_(part.comm()) {
    const std::vector<Vector3> places = positions_of(points_);
    Nearest nearest(part, places);
    distances_ = std::move(nearest.distances);
    int rank = 0;
    if (comm_ != MPI_COMM_SELF) MPI_Comm_rank(comm_, &rank);
    std::vector<Vector3> here;
    for (std::size_t i = 0; i < places.size(); ++i)
        if (nearest.ranks[i] == rank) {
            mine_.push_back(i);
            here.push_back(places[i]);
        }
    if (!here.empty()) sampler_.emplace(tets_at(part.mesh(), here, nodes_), here);
}

std::vector<Vector3> Probes::sample(std::span<const Vector3> local) const {
    std::vector<Vector3> at_points(points_.size(), Vector3::Zero()), of_tets;
    for (const std::int32_t n : nodes_) of_tets.push_back(local[n]);
    for (std::size_t k = 0; k < mine_.size(); ++k)
        at_points[mine_[k]] = sampler_->sample(k, of_tets);
    if (comm_ != MPI_COMM_SELF && !at_points.empty())
        sum_over_ranks(comm_, {at_points.front().data(), 3 * at_points.size()});
    return at_points;
}

}  // namespace livetet
