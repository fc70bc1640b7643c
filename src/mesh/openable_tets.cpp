#include "mesh/openable_tets.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <utility>

#include "base/sliced_task.hpp"
#include "mesh/movable_nodes.hpp"
#include "mesh/node_copies.hpp"
#include "mesh/rest_iteration.hpp"
#include "mesh/segment_crossings.hpp"
#include "mesh/tet_frame.hpp"

namespace livetet {

namespace {

/// Share of a cell's edge to which rest places are found.
constexpr double rest_tolerance = 1e-7;
/// How often nodes are moved, one after another: a move may make room for another.
constexpr int max_sweeps = 3;

/// Pieces of fewer tets are not cut off.
constexpr int least_piece = 6;

double mean_edge(const TetMesh& mesh) {
    double sum = 0;
    for (const Tet& t : mesh.tets)
        for (const auto& [a, b] : tet_edges) sum += (mesh.nodes[t[a]] - mesh.nodes[t[b]]).norm();
    return sum / (6 * static_cast<double>(mesh.tets.size()));
}

/// A plane near points, if they lie about one.
struct NearPlane {
    Vector3 point, normal;
    bool is_found = false;
};

/// The least-squares plane of at least three points that are neither on a line nor all around.
NearPlane plane_through(std::span<const Vector3> points) {
    constexpr double least_width = 0.01, most_height = 0.25;  // mean squares, by the next greater
    NearPlane plane{Vector3::Zero(), Vector3::Zero()};
    const auto count = static_cast<double>(points.size());
    for (const Vector3& x : points) plane.point += x / count;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vector3& x : points)
        spread += (x - plane.point) * (x - plane.point).transpose() / count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
    const Vector3& size = eigen.eigenvalues();
    plane.normal = eigen.eigenvectors().col(0);
    plane.is_found =
        points.size() >= 3 && size[1] > least_width * size[2] && size[0] <= most_height * size[1];
    return plane;
}

/// The displacement u at a place in a tet, and 1 + grad u; on ten nodes
///
///     u = sum_i L_i (2 L_i - 1) u_i + sum_{i<j} 4 L_i L_j u_ij.
RestMotion motion_in(const TetMesh& mesh, std::int32_t tet, const Vector3& place,
                     std::span<const Vector3> displacement) {
    const Tet& t = mesh.tets[tet];
    const TetFrame frame = frame_of(mesh, t);
    const std::array<double, 4> L = frame.weights(place);
    std::array<Eigen::RowVector3d, 4> slope;  // of L_i
    for (int i = 1; i < 4; ++i) slope[i] = frame.inverse.row(i - 1);
    slope[0] = -(slope[1] + slope[2] + slope[3]);
    RestMotion motion{Vector3::Zero(), Eigen::Matrix3d::Identity()};
    const auto add = [&](std::int32_t node, double value, const Eigen::RowVector3d& gradient) {
        motion.u += value * displacement[node];
        motion.gradient += displacement[node] * gradient;
    };
    const bool is_quadratic = !mesh.edge_nodes.empty();
    for (int i = 0; i < 4; ++i)
        if (is_quadratic)
            add(t[i], L[i] * (2 * L[i] - 1), (4 * L[i] - 1) * slope[i]);
        else
            add(t[i], L[i], slope[i]);
    if (!is_quadratic) return motion;
    for (int k = 0; k < 6; ++k) {
        const auto& [i, j] = tet_edges[k];
        add(mesh.edge_nodes[tet][k], 4 * L[i] * L[j], 4 * (L[i] * slope[j] + L[j] * slope[i]));
    }
    return motion;
}

/// Moves nodes onto the planes through the crossings around them. `crossings`: of each node.
std::vector<MovedNode> move_onto_cut(
    TetMesh& mesh, const std::map<std::int32_t, std::vector<Vector3>>& crossings) {
    const std::vector<Vector3> before = mesh.nodes;
    MovableNodes movable(mesh);
    pause_point();
    for (int sweep = 0; sweep < max_sweeps; ++sweep)
        for (const auto& [node, points] : crossings) {
            const NearPlane plane = plane_through(points);
            if (plane.is_found)
                movable.move(node, movable.way_to_plane(node, plane.point, plane.normal));
        }
    std::vector<MovedNode> moved;
    const std::vector<Vector3> after = std::exchange(mesh.nodes, before);
    for (const auto& [node, points] : crossings) {
        if (after[node] == before[node]) continue;
        MovedNode& m = moved.emplace_back(MovedNode{node, after[node] - before[node], {}, {}});
        HoldingTet holding;
        holding.look(mesh, movable.tets_at(node), after[node]);
        std::ranges::copy(mesh.tets[holding.tet], m.nodes.begin());
        std::ranges::copy(holding.weights, m.weights.begin());
    }
    mesh.nodes = after;
    return moved;
}

}  // namespace

OpenableTets::Level OpenableTets::level_of(const TetMesh& mesh) {
    std::vector<TetLink> links = links_of(mesh.tets);
    const std::size_t count = links.size();
    Level level{{mesh.nodes.front(), mesh.nodes.front()},
                {},
                std::move(links),
                LinkCuts(count),
                std::vector<Vector3>(count),
                {},
                {}};
    for (const Vector3& x : mesh.nodes)
        level.box = {level.box[0].cwiseMin(x), level.box[1].cwiseMax(x)};
    level.was_parted.assign(mesh.nodes.size(), 0);
    level.is_parted = level.was_parted;
    for (const auto& [a, b, c, d] : mesh.tets)
        level.middles.push_back((mesh.nodes[a] + mesh.nodes[b] + mesh.nodes[c] + mesh.nodes[d]) /
                                4);
    return level;
}

OpenableTets::OpenableTets(const std::vector<TetMesh>& levels, std::string where)
    : where_(std::move(where)), locator_(levels.front()), cell_edge_(mean_edge(levels.front())) {
    for (const TetMesh& level : levels) levels_.push_back(level_of(level));
    finest_.nodes = levels.front().nodes;
    finest_.tets = levels.front().tets;
}

/// The displacement of the tet that a place was in as the mesh was loaded: nodes that moved onto
/// cuts since did so by a part of an edge.
Vector3 OpenableTets::rest_place(const Vector3& y, const TetMesh& mesh,
                                 std::span<const Vector3> displacement) const {
    return find_rest_place(y, rest_tolerance * cell_edge_, [&](const Vector3& x) {
        const PointLocator::Hit hit = locator_.find(x);
        Vector3 place = x;
        if (hit.distance > 0) {
            place.setZero();
            for (int k = 0; k < 4; ++k) place += hit.weights[k] * finest_.nodes[hit.corners[k]];
        }
        RestMotion motion = motion_in(mesh, hit.tet, place, displacement);
        if (hit.distance > 0) motion.gradient.setIdentity();
        return motion;
    });
}

bool OpenableTets::holds(const Vector3& place) const { return locator_.find(place).distance == 0; }

std::size_t OpenableTets::cut(const TriangleMesh& surface) {
    std::size_t fresh = 0;
    if (surface.triangles.empty()) return fresh;
    Eigen::AlignedBox3d box;
    for (const Vector3& x : surface.nodes) box.extend(x);
    for (Level& level : levels_) {
        const SegmentCrossings crossings(surface, level.box, where_);
        if (!box.intersects(Eigen::AlignedBox3d(level.box[0], level.box[1]))) continue;
        for (std::size_t l = 0; l < level.links.size(); ++l) {
            const Vector3 &from = level.middles[level.links[l].lower],
                          &to = level.middles[level.links[l].upper];
            if (level.cuts.cut[l] ||
                !box.intersects(Eigen::AlignedBox3d(from.cwiseMin(to), from.cwiseMax(to))))
                continue;
            const SegmentCrossing crossing = crossings.between(from, to);
            if (!crossing.parts()) continue;
            level.cuts.cut[l] = 1;
            level.crossings[l] = from + crossing.first * (to - from);
            if (&level == &levels_.front()) ++fresh;
        }
    }
    return fresh;
}

OpenedNodes OpenableTets::open_level(Level& level, TetMesh& mesh) const {
    std::vector<Tet> tets = mesh.tets;
    OpenedNodes nodes;
    nodes.originals = part_nodes(tets, mesh.nodes.size(), level.links, level.cuts.cut);
    pause_point();
    std::map<std::int32_t, std::vector<Vector3>> crossings;  // of nodes that are first doubled
    for (const std::int32_t n : nodes.originals)
        if (!level.was_parted[n]) crossings[n];
    for (std::size_t l = 0; l < level.links.size(); ++l) {
        if (!level.cuts.cut[l]) continue;
        const Tet& other = mesh.tets[level.links[l].upper];
        for (const std::int32_t n : mesh.tets[level.links[l].lower])
            if (const auto at = crossings.find(n);
                at != crossings.end() && std::ranges::find(other, n) != other.end())
                at->second.push_back(level.crossings[l]);
    }
    nodes.moved = move_onto_cut(mesh, crossings);
    pause_point();
    level.is_parted = level.was_parted;
    for (const std::int32_t n : nodes.originals) level.is_parted[n] = 1;
    level.is_parted.resize(mesh.nodes.size() + nodes.originals.size(), 1);
    mesh.triangle_sets = moved_sets(mesh, tets);
    pause_point();
    mesh.tets = std::move(tets);
    append_copies(mesh, nodes.originals);
    return nodes;
}

void OpenableTets::rejoin_crumbs() {
    for (Level& level : levels_) {
        level.cuts.rejoin_small_pieces(level.links, level.middles.size(), least_piece);
        pause_point();
    }
}

OpenedLevels OpenableTets::open(const std::vector<TetMesh>& levels) {
    rejoin_crumbs();
    OpenedLevels opened{levels, {}};
    for (std::size_t l = levels_.size(); l-- > 0;)
        opened.nodes = open_level(levels_[l], opened.levels[l]);
    return opened;
}

void OpenableTets::keep() {
    for (Level& level : levels_) {
        level.cuts.keep();
        level.was_parted = level.is_parted;
    }
}

void OpenableTets::undo() {
    for (Level& level : levels_) {
        level.cuts.undo();
        level.is_parted = level.was_parted;
    }
}

}  // namespace livetet
