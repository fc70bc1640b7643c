#include "mesh/clipped_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "mesh/grid_border.hpp"

namespace livetet {

namespace {

constexpr double level = 0.5, rounding = 1e-9;
constexpr double nearest = 0.1;  ///< of an edge: of a point to a node

/// Adds up what nodes at the same place have, and gives it to each of them.
void join_places(const std::vector<Vector3>& nodes, std::vector<double>& values) {
    std::vector<std::int32_t> order(nodes.size());
    std::iota(order.begin(), order.end(), 0);
    const auto key = [&](std::int32_t n) {
        return std::array{nodes[n].x(), nodes[n].y(), nodes[n].z()};
    };
    std::ranges::sort(order, {}, key);
    for (std::size_t from = 0, to = 0; from < order.size(); from = to) {
        double sum = 0;
        for (; to < order.size() && key(order[to]) == key(order[from]); ++to)
            sum += values[order[to]];
        for (std::size_t k = from; k < to; ++k) values[order[k]] = sum;
    }
}

/// Of each node the tissue around it, at least `level` at the nodes of whole and of thin cells.
std::vector<double> levels_of_nodes(const TetMesh& mesh) {
    std::vector<double> tissue = tissue_around(mesh);
    join_places(mesh.nodes, tissue);
    std::vector<double> raised = tissue;
    const std::vector<std::uint8_t> is_solid = solid_cells(mesh);
    const auto raise = [&](const auto& cells) {
        for (std::size_t e = 0; e < cells.size(); ++e) {
            const bool is_whole = mesh.shares[e] > 1 - rounding;
            const bool is_thin = is_solid[e] && std::ranges::all_of(cells[e], [&](std::int32_t n) {
                                     return tissue[n] < level;
                                 });
            if (!is_whole && !is_thin) continue;
            for (const std::int32_t n : cells[e]) raised[n] = std::max(raised[n], level);
        }
    };
    raise(mesh.hexahedra);
    raise(mesh.quadratic_hexahedra);
    return raised;
}

class Clipping {
  public:
    Clipping(const TetMesh& mesh, ClippedTets& out)
        : mesh_(mesh), values_(levels_of_nodes(mesh)), out_(out) {}

    /// Adds what of a tet is inside. p(i, o) is where the surface crosses the edge from its inner
    /// node i to its outer node o. Of a face with two inner nodes a quadrilateral is left: its
    /// diagonal starts at the lower of the two, so that neighbours match.
    void clip(const Tet& t) {
        std::vector<std::int32_t>& in = in_;
        std::vector<std::int32_t>& out = outside_;
        in.clear();
        out.clear();
        for (const std::int32_t n : t) (is_inside(n) ? in : out).push_back(n);
        std::ranges::sort(in);
        const auto p = [&](std::size_t i, std::size_t o) { return point(in[i], out[o]); };
        if (in.size() == 4) {
            out_.tets.push_back(t);
        } else if (in.size() == 1) {
            add({in[0], p(0, 0), p(0, 1), p(0, 2)});
        } else if (in.size() == 2) {
            add({in[0], in[1], p(1, 0), p(1, 1)});
            add({in[0], p(0, 0), p(1, 0), p(1, 1)});
            add({in[0], p(0, 0), p(1, 1), p(0, 1)});
        } else if (in.size() == 3) {
            add({in[0], in[1], in[2], p(2, 0)});
            add({in[0], in[1], p(1, 0), p(2, 0)});
            add({in[0], p(0, 0), p(1, 0), p(2, 0)});
        }
    }

  private:
    bool is_inside(std::int32_t n) const { return values_[n] >= level - rounding; }

    Vector3 place(std::int32_t n) const {
        const auto nodes = static_cast<std::int32_t>(mesh_.nodes.size());
        if (n < nodes) return mesh_.nodes[n];
        const EdgePoint& p = out_.points[static_cast<std::size_t>(n - nodes)];
        return (1 - p.share) * mesh_.nodes[p.a] + p.share * mesh_.nodes[p.b];
    }
    /// A node of the edge, if the point is near it: else numbered from the mesh's nodes on. From
    /// inside outwards, so that both sides of a cut have the same places to the bit.
    std::int32_t point(std::int32_t inside, std::int32_t outside) {
        const double share = (values_[inside] - level) / (values_[inside] - values_[outside]);
        if (share < nearest) return inside;
        if (share > 1 - nearest) return outside;
        const auto next = static_cast<std::int32_t>(mesh_.nodes.size() + out_.points.size());
        const auto [found, is_new] = numbers_.try_emplace({inside, outside}, next);
        if (is_new) out_.points.push_back({inside, outside, share});
        return found->second;
    }
    /// Leaves out flat ones: where points are nodes, all four may be in a face.
    void add(Tet t) {
        const Vector3 a = place(t[0]), ab = place(t[1]) - a, ac = place(t[2]) - a,
                      ad = place(t[3]) - a;
        const double volume = ab.cross(ac).dot(ad);
        if (std::abs(volume) <= rounding * ab.norm() * ac.norm() * ad.norm()) return;
        if (volume < 0) std::swap(t[2], t[3]);
        out_.tets.push_back(t);
    }

    const TetMesh& mesh_;
    std::vector<double> values_;  ///< of the nodes
    ClippedTets& out_;
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> numbers_;
    std::vector<std::int32_t> in_, outside_;  ///< of the present tet
};

}  // namespace

std::vector<Vector3> ClippedTets::at_nodes(std::vector<Vector3> of_mesh) const {
    of_mesh.reserve(of_mesh.size() + points.size());
    for (const auto& [a, b, share] : points)
        of_mesh.push_back((1 - share) * of_mesh[a] + share * of_mesh[b]);
    return of_mesh;
}

ClippedTets clipped_grid(const TetMesh& mesh) {
    ClippedTets clipped;
    Clipping clipping(mesh, clipped);
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
        clipping.clip(mesh.tets[t]);
        clipped.parents.resize(clipped.tets.size(), static_cast<std::int32_t>(t));
    }
    return clipped;
}

}  // namespace livetet
