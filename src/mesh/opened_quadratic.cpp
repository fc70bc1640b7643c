#include "mesh/opened_quadratic.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "base/lists.hpp"
#include "base/sliced_task.hpp"
#include "mesh/mesh_edges.hpp"
#include "mesh/node_copies.hpp"
#include "mesh/tet_frame.hpp"

namespace livetet {

namespace {

/// Of each node of a mesh of four-node tets: its number in that of the same tets with ten nodes.
std::vector<std::int32_t> corners_in(const TetMesh& quadratic, const TetMesh& linear) {
    std::vector<std::int32_t> corner(linear.nodes.size(), -1);
    for (std::size_t e = 0; e < linear.tets.size(); ++e)
        for (int i = 0; i < 4; ++i) corner[linear.tets[e][i]] = quadratic.tets[e][i];
    return corner;
}

/// Gives the edges of `mesh`, whose corners are those of the opened tets, their midpoints: those of
/// `before`, of edges without a copied end first, and copies. `first`: the first copied corner;
/// `next`: the first copied midpoint. Returns the copies' originals.
std::vector<std::int32_t> number_midpoints(TetMesh& mesh, std::int32_t first, std::int32_t next) {
    const std::vector<std::array<std::int32_t, 6>> before = mesh.edge_nodes;
    std::vector<std::uint8_t> is_taken(mesh.nodes.size(), 0);
    const auto has_copy = [&](std::size_t e, int k) {
        return mesh.tets[e][tet_edges[k][0]] >= first || mesh.tets[e][tet_edges[k][1]] >= first;
    };
    for (std::size_t e = 0; e < before.size(); ++e)
        for (int k = 0; k < 6; ++k)
            if (!has_copy(e, k)) is_taken[before[e][k]] = 1;
    std::unordered_map<std::uint64_t, std::int32_t> number;
    std::vector<std::int32_t> originals;
    for (std::size_t e = 0; e < before.size(); ++e)
        for (int k = 0; k < 6; ++k) {
            if (!has_copy(e, k)) continue;
            const auto key = edge_key(mesh.tets[e][tet_edges[k][0]], mesh.tets[e][tet_edges[k][1]]);
            const std::int32_t original = before[e][k];
            const auto [found, is_new] = number.try_emplace(key, original);
            if (is_new && std::exchange(is_taken[original], 1)) {
                found->second = next++;
                originals.push_back(original);
            }
            mesh.edge_nodes[e][k] = found->second;
        }
    return originals;
}

/// Places of the ten-node mesh before.
class PlacesBefore {
  public:
    explicit PlacesBefore(const TetMesh& mesh)
        : mesh_(mesh), stars_(make_lists(mesh.nodes.size(), [&](auto&& add) {
              for (std::size_t e = 0; e < mesh.tets.size(); ++e)
                  for (const std::int32_t n : mesh.tets[e]) add(n, static_cast<std::int32_t>(e));
          })) {}

    /// A node that is at `to` now, beside some corners: in the tet of theirs that holds it, or
    /// nearly so. The value there is sum_i L_i (2 L_i - 1) v_i + sum_{i<j} 4 L_i L_j v_ij.
    MovedNode moved(std::int32_t node, const Vector3& to,
                    std::initializer_list<std::int32_t> corners) const {
        MovedNode m{node, to - mesh_.nodes[node], {}, {}};
        HoldingTet holding;
        for (const std::int32_t corner : corners) holding.look(mesh_, stars_[corner], to);
        const auto& L = holding.weights;
        for (int i = 0; i < 4; ++i) {
            m.nodes[i] = mesh_.tets[holding.tet][i];
            m.weights[i] = L[i] * (2 * L[i] - 1);
        }
        for (int k = 0; k < 6; ++k) {
            m.nodes[4 + k] = mesh_.edge_nodes[holding.tet][k];
            m.weights[4 + k] = 4 * L[tet_edges[k][0]] * L[tet_edges[k][1]];
        }
        return m;
    }

  private:
    const TetMesh& mesh_;
    Lists stars_;  ///< the tets at each corner
};

/// Puts corners where those of the four-node mesh are, and midpoints between them. Returns what
/// moved of the nodes before.
std::vector<MovedNode> move_nodes(TetMesh& mesh, const TetMesh& before,
                                  const std::vector<std::int32_t>& corner, const TetMesh& linear,
                                  const std::vector<MovedNode>& moved_corners) {
    std::vector<MovedNode> moved;
    if (moved_corners.empty()) return moved;
    const PlacesBefore places(before);
    pause_point();
    for (std::size_t n = 0; n < linear.nodes.size(); ++n) mesh.nodes[corner[n]] = linear.nodes[n];
    for (const MovedNode& m : moved_corners) {
        const std::int32_t n = corner[m.node];
        moved.push_back(places.moved(n, mesh.nodes[n], {n}));
    }
    std::vector<std::uint8_t> is_done(mesh.nodes.size(), 0);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int k = 0; k < 6; ++k) {
            const std::int32_t n = mesh.edge_nodes[e][k];
            if (std::exchange(is_done[n], 1)) continue;
            const auto& [i, j] = tet_edges[k];
            const Vector3 to = (mesh.nodes[mesh.tets[e][i]] + mesh.nodes[mesh.tets[e][j]]) / 2;
            if (to == mesh.nodes[n]) continue;
            mesh.nodes[n] = to;
            if (static_cast<std::size_t>(n) < before.nodes.size())
                moved.push_back(places.moved(n, to, {before.tets[e][i], before.tets[e][j]}));
        }
    return moved;
}

}  // namespace

OpenedLevels with_opened_quadratic(const std::vector<TetMesh>& before, OpenedLevels opened) {
    const TetMesh &linear = opened.levels.front(), &old = before.front();
    const auto first = static_cast<std::int32_t>(old.nodes.size());
    std::vector<std::int32_t> corner = corners_in(old, before[1]);
    OpenedNodes nodes;
    for (const std::int32_t n : opened.nodes.originals) {
        corner.push_back(first + static_cast<std::int32_t>(nodes.originals.size()));
        nodes.originals.push_back(corner[n]);
    }
    TetMesh mesh = old;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int i = 0; i < 4; ++i) mesh.tets[e][i] = corner[linear.tets[e][i]];
    pause_point();
    const auto midpoints =
        number_midpoints(mesh, first, first + static_cast<std::int32_t>(nodes.originals.size()));
    nodes.originals.insert(nodes.originals.end(), midpoints.begin(), midpoints.end());
    append_copies(mesh, nodes.originals);
    mesh.triangle_sets = linear.triangle_sets;
    for (auto& [name, triangles] : mesh.triangle_sets)
        for (Triangle& t : triangles)
            for (std::int32_t& n : t) n = corner[n];
    pause_point();
    nodes.moved = move_nodes(mesh, old, corner, linear, opened.nodes.moved);
    opened.nodes = std::move(nodes);
    opened.levels.insert(opened.levels.begin(), std::move(mesh));
    return opened;
}

}  // namespace livetet
