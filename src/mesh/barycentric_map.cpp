#include "mesh/barycentric_map.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/error.hpp"
#include "base/thread_team.hpp"
#include "geometry/nearest_triangle.hpp"

namespace livetet {

namespace {

/// Weights down to this still count as inside, so that rounding cannot push a point on an inner
/// face out of both tets. Clamping them to zero moves the point by less than 1e-8 of an edge.
constexpr double inside_tolerance = 1e-8;

using Weights = std::array<double, 4>;

/// Barycentric coordinates in a tet: lambda_{1,2,3} = [x1 - x0, x2 - x0, x3 - x0]^-1 (x - x0),
/// lambda_0 = 1 - lambda_1 - lambda_2 - lambda_3.
struct TetFrame {
    Vector3 origin;
    Eigen::Matrix3d inverse;

    Weights weights(const Vector3& x) const {
        const Vector3 w = inverse * (x - origin);
        return {1 - w.x() - w.y() - w.z(), w.x(), w.y(), w.z()};
    }
};

TetFrame frame_of(const TetMesh& mesh, const std::array<std::int32_t, 4>& t) {
    const Vector3& origin = mesh.nodes[t[0]];
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes[t[k + 1]] - origin;
    return {origin, edges.inverse()};
}

/// Uniform grid with about as many cells as tets. Each cell lists the tets whose bounding boxes
/// touch it: tets_[first_[c]] to tets_[first_[c + 1] - 1].
class TetGrid {
  public:
    explicit TetGrid(const TetMesh& mesh) {
        for (const Vector3& x : mesh.nodes) box_.extend(x);
        const double margin = 1e-9 * box_.diagonal().norm();
        box_ = {box_.min() - Vector3::Constant(margin), box_.max() + Vector3::Constant(margin)};
        const Vector3 extent = box_.sizes();
        const double cell = std::cbrt(extent.prod() / static_cast<double>(mesh.tets.size()));
        for (int d = 0; d < 3; ++d)
            cells_[d] = std::clamp(static_cast<int>(extent[d] / cell), 1, 1024);
        per_metre_ = cells_.cast<double>().cwiseQuotient(extent);
        build_frames(mesh);
        fill(mesh);
    }

    /// The tet that contains x, and x's weights in it; -1 if there is none.
    std::int32_t find(const Vector3& x, Weights& weights) const {
        if (!box_.contains(x)) return -1;
        const std::size_t c = index(cell_of(x));
        std::int32_t best = -1;
        double best_weight = -inside_tolerance;
        for (std::int32_t i = first_[c]; i < first_[c + 1]; ++i) {
            const Weights w = frames_[tets_[i]].weights(x);
            const double min_weight = std::min(std::min(w[0], w[1]), std::min(w[2], w[3]));
            if (!(min_weight >= best_weight)) continue;
            best = tets_[i];
            weights = w;
            if (min_weight >= 0) break;
            best_weight = min_weight;
        }
        return best;
    }

  private:
    Eigen::Vector3i cell_of(const Vector3& x) const {
        const Eigen::Vector3i c = (x - box_.min()).cwiseProduct(per_metre_).cast<int>();
        return c.cwiseMax(0).cwiseMin(cells_ - Eigen::Vector3i::Ones());
    }

    std::size_t index(const Eigen::Vector3i& c) const {
        return c.x() + static_cast<std::size_t>(cells_.x()) *
                           (c.y() + static_cast<std::size_t>(cells_.y()) * c.z());
    }

    void build_frames(const TetMesh& mesh) {
        frames_.reserve(mesh.tets.size());
        for (const Tet& t : mesh.tets) frames_.push_back(frame_of(mesh, t));
    }

    template <class Visit>
    void for_each_cell(const TetMesh& mesh, const Tet& t, const Visit& visit) const {
        Eigen::AlignedBox3d box;
        for (const std::int32_t n : t) box.extend(mesh.nodes[n]);
        const Vector3 margin = Vector3::Constant(inside_tolerance * box.diagonal().norm());
        const Eigen::Vector3i low = cell_of(box.min() - margin);
        const Eigen::Vector3i high = cell_of(box.max() + margin);
        for (int k = low.z(); k <= high.z(); ++k)
            for (int j = low.y(); j <= high.y(); ++j)
                for (int i = low.x(); i <= high.x(); ++i) visit(index({i, j, k}));
    }

    void fill(const TetMesh& mesh) {
        first_.assign(static_cast<std::size_t>(cells_.x()) * cells_.y() * cells_.z() + 1, 0);
        for (const Tet& t : mesh.tets)
            for_each_cell(mesh, t, [&](std::size_t c) { ++first_[c + 1]; });
        for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
        tets_.resize(first_.back());
        std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
        for (std::size_t e = 0; e < mesh.tets.size(); ++e)
            for_each_cell(mesh, mesh.tets[e],
                          [&](std::size_t c) { tets_[next[c]++] = static_cast<std::int32_t>(e); });
    }

    Eigen::AlignedBox3d box_;
    Eigen::Vector3i cells_;
    Vector3 per_metre_;
    std::vector<TetFrame> frames_;
    std::vector<std::int32_t> first_, tets_;
};

/// The fourth node of the tet behind each boundary triangle. Boundary triangles are in the order of
/// their tets and each belongs to one tet, so one pass over both lists is enough.
std::vector<std::int32_t> fourth_nodes(std::span<const Tet> tets,
                                       std::span<const Triangle> boundary) {
    std::vector<std::int32_t> fourth;
    fourth.reserve(boundary.size());
    for (const Tet& t : tets)
        while (fourth.size() < boundary.size()) {
            const Triangle& f = boundary[fourth.size()];
            const auto in_face = [&](std::int32_t n) {
                return n == f[0] || n == f[1] || n == f[2];
            };
            if (std::count_if(t.begin(), t.end(), in_face) < 3) break;
            fourth.push_back(*std::find_if_not(t.begin(), t.end(), in_face));
        }
    return fourth;
}

/// Clamps weights that rounding made negative to zero and rescales the sum to one.
Weights clamped(Weights w) {
    double sum = 0;
    for (double& value : w) sum += value = std::max(value, 0.0);
    for (double& value : w) value /= sum;
    return w;
}

/// Moves from the boundary point `near` towards `at` as far as no weight is below
/// min_extrapolated_weight.
Weights extrapolated(const Weights& near, const Weights& at) {
    double part = 1;
    for (int k = 0; k < 4; ++k)
        if (at[k] < min_extrapolated_weight)
            part = std::min(part, (near[k] - min_extrapolated_weight) / (near[k] - at[k]));
    Weights w;
    for (int k = 0; k < 4; ++k) w[k] = near[k] + part * (at[k] - near[k]);
    return w;
}

}  // namespace

BarycentricMap map_into(const TetMesh& mesh, std::span<const Vector3> points, Outside outside) {
    if (mesh.tets.empty())
        fail("barycentric map: the mesh has no tetrahedra, expected at least one");
    const TetGrid grid(mesh);
    const std::vector<Triangle> boundary = boundary_triangles(mesh.tets);
    const std::vector<std::int32_t> fourth = fourth_nodes(mesh.tets, boundary);
    const NearestTriangle nearest(mesh.nodes, boundary);

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
            Weights w{};
            if (const std::int32_t tet = grid.find(points[i], w); tet >= 0) {
                map.nodes[i] = mesh.tets[tet];
                map.weights[i] = clamped(w);
                continue;
            }
            const NearestTriangle::Hit hit = nearest.find(points[i]);
            const Triangle& f = boundary[hit.triangle];
            map.nodes[i] = {f[0], f[1], f[2], fourth[hit.triangle]};
            map.weights[i] = {hit.weights[0], hit.weights[1], hit.weights[2], 0.0};
            map.distance[i] = hit.distance;
            if (outside == Outside::extrapolated)
                map.weights[i] =
                    extrapolated(map.weights[i], frame_of(mesh, map.nodes[i]).weights(points[i]));
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
