#include "meshing/optimise.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "mesh/tet_faces.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/quality.hpp"
#include "meshing/stars.hpp"

namespace livetet {

namespace {

constexpr int max_passes = 12;
/// Maximum distance of a crease node from the body's surface, in mean edges.
constexpr double crease_slack = 0.05;
/// Minimum cosine of the angle by which one move may turn a boundary triangle.
constexpr double min_normal_cosine = 0.5;
constexpr std::size_t max_ring = 7;  ///< maximum number of tets around an edge to remove
constexpr double min_gain = 1e-4;    ///< minimum increase of `shape` of a node move
constexpr double inverted = -2;      ///< below any value of `shape`

/// Quality of a tet: minus the cosine of its smallest dihedral angle, which increases with the
/// angle; `inverted` for a volume that is not positive. Two faces with outward normals n_i, n_j
/// have the dihedral angle acos(-n_i . n_j).
double shape(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    const Vector3 ab = b - a, ac = c - a, ad = d - a;
    if (!(ab.dot(ac.cross(ad)) > 0)) return inverted;
    const std::array<Vector3, 4> n{(c - b).cross(d - b).normalized(), ad.cross(ac).normalized(),
                                   ab.cross(ad).normalized(), ac.cross(ab).normalized()};
    double worst = 1;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) worst = std::min(worst, n[i].dot(n[j]));
    return worst;
}

/// The two regions of an interface, the lower one first.
using Patch = std::array<std::int32_t, 2>;

Patch patch_of(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The surface along which a patch's nodes move; null: they stay in place.
using Guide = std::function<const NearestTriangle*(const Patch&)>;

class Optimiser {
  public:
    Optimiser(TetMesh& mesh, Guide guide, double aim_deg)
        : mesh_(mesh),
          guide_(std::move(guide)),
          aim_(-std::cos(aim_deg * std::numbers::pi / 180)),
          alive_(mesh.tets.size(), true),
          stars_(stars_of(mesh)),
          on_surface_(mesh.nodes.size(), false) {
        for (const InterfaceTriangle& f : interface_triangles(mesh))
            for (const std::int32_t n : f.nodes) on_surface_[n] = true;
    }

    void run() {
        for (int pass = 0; pass < max_passes; ++pass) {
            Star poor;
            for (std::size_t t = 0; t < mesh_.tets.size(); ++t)
                if (alive_[t] && shape(mesh_.tets[t]) < aim_)
                    poor.push_back(static_cast<std::int32_t>(t));
            bool changed = false;
            for (const std::int32_t t : poor)
                if (alive_[t] && shape(mesh_.tets[t]) < aim_) changed |= improve(t);
            if (!changed) break;
        }
        compact();
    }

    OptimiseReport report;

  private:
    double shape(const Tet& t) const {
        return livetet::shape(mesh_.nodes[t[0]], mesh_.nodes[t[1]], mesh_.nodes[t[2]],
                              mesh_.nodes[t[3]]);
    }

    double worst_of(const Star& tets) const {
        double worst = 1;
        for (const std::int32_t t : tets) worst = std::min(worst, shape(mesh_.tets[t]));
        return worst;
    }

    static bool has(const Tet& t, std::int32_t n) {
        return std::find(t.begin(), t.end(), n) != t.end();
    }

    /// The tets that contain all of these nodes.
    Star tets_with(std::initializer_list<std::int32_t> nodes) const {
        Star found;
        for (const std::int32_t t : stars_[*nodes.begin()])
            if (std::all_of(nodes.begin(), nodes.end(),
                            [&](std::int32_t n) { return has(mesh_.tets[t], n); }))
                found.push_back(t);
        return found;
    }

    std::int32_t region(std::int32_t t) const {
        return mesh_.regions.empty() ? 1 : mesh_.regions[t];
    }

    bool exposed(std::int32_t a, std::int32_t b, std::int32_t c) const {
        return tets_with({a, b, c}).size() == 1;
    }

    /// Whether the triangle is on the boundary of a region.
    bool on_boundary(std::int32_t a, std::int32_t b, std::int32_t c) const {
        const Star both = tets_with({a, b, c});
        return both.size() == 1 || region(both[0]) != region(both[1]);
    }

    /// Whether the edge belongs to a boundary triangle.
    bool on_boundary(std::int32_t a, std::int32_t b) const {
        if (!on_surface_[a] || !on_surface_[b]) return false;
        for (const std::int32_t t : tets_with({a, b}))
            for (const std::int32_t c : mesh_.tets[t])
                if (c != a && c != b && on_boundary(a, b, c)) return true;
        return false;
    }

    struct BoundaryTriangle {
        Triangle nodes;  ///< wound outwards from one of its regions
        Patch patch;
    };

    /// The boundary triangles around a node.
    std::vector<BoundaryTriangle> boundary_about(std::int32_t n) const {
        std::vector<BoundaryTriangle> found;
        if (!on_surface_[n]) return found;
        for (const std::int32_t t : stars_[n]) {
            const Tet& tet = mesh_.tets[t];
            for (const auto& [i, j, k] : tet_faces) {
                const Triangle f{tet[i], tet[j], tet[k]};
                if (f[0] != n && f[1] != n && f[2] != n) continue;
                const Star both = tets_with({f[0], f[1], f[2]});
                const std::int32_t here = region(t);
                const std::int32_t there =
                    both.size() == 1 ? 0 : region(both[0] == t ? both[1] : both[0]);
                if (both.size() == 1 || here < there) found.push_back({f, patch_of(here, there)});
            }
        }
        return found;
    }

    static std::vector<Patch> patches_of(const std::vector<BoundaryTriangle>& triangles) {
        std::vector<Patch> patches;
        for (const BoundaryTriangle& f : triangles)
            if (std::find(patches.begin(), patches.end(), f.patch) == patches.end())
                patches.push_back(f.patch);
        return patches;
    }

    Vector3 normal(const Triangle& f) const {
        const Vector3& a = mesh_.nodes[f[0]];
        return (mesh_.nodes[f[1]] - a).cross(mesh_.nodes[f[2]] - a).normalized();
    }

    void add(const Tet& tet, std::int32_t region) {
        for (const std::int32_t n : tet)
            stars_[n].push_back(static_cast<std::int32_t>(mesh_.tets.size()));
        mesh_.tets.push_back(tet);
        if (!mesh_.regions.empty()) mesh_.regions.push_back(region);
        alive_.push_back(true);
    }

    void remove(std::int32_t t) {
        alive_[t] = false;
        for (const std::int32_t n : mesh_.tets[t]) std::erase(stars_[n], t);
    }

    /// Replaces the tets `old` by `fresh` if that raises the smallest angle. `regions`: the regions
    /// of `fresh` if those of `old` differ.
    bool replace(const Star& old, const std::vector<Tet>& fresh, std::int64_t& count,
                 const std::vector<std::int32_t>& regions = {}) {
        const double worst = worst_of(old);
        for (const Tet& t : fresh)
            if (shape(t) <= worst) return false;
        const std::int32_t common = region(old[0]);
        for (const std::int32_t t : old) remove(t);
        for (std::size_t i = 0; i < fresh.size(); ++i)
            add(fresh[i], regions.empty() ? common : regions[i]);
        ++count;
        return true;
    }

    bool improve(std::int32_t t) {
        const Tet tet = mesh_.tets[t];
        if (peel(t) || hand_over(t)) return true;
        for (const auto& [i, j] : tet_edges)
            if (remove_edge(tet[i], tet[j])) return true;
        for (int i = 0; i < 4; ++i)
            if (swap_face(t, i)) return true;
        bool moved = false;
        for (const std::int32_t n : tet) moved |= move(n);
        if (moved && shape(tet) >= aim_) return true;
        for (const std::int32_t from : tet)
            for (const std::int32_t to : tet)
                if (from != to && collapse(from, to)) return true;
        return moved;
    }

    /// Whether a tet is so flat that the faces at edge a b, and those at edge c d, are nearly
    /// coplanar.
    bool flat(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) const {
        const Vector3 ab = mesh_.nodes[b] - mesh_.nodes[a], cd = mesh_.nodes[d] - mesh_.nodes[c];
        const Vector3 across = ab.cross(cd).normalized();
        return std::abs(across.dot(mesh_.nodes[c] - mesh_.nodes[a])) <=
               crease_slack * (ab.norm() + cd.norm());
    }

    /// Calls `take` with the nodes a, b, c, d of the tet for each of its edges a b, until it
    /// returns true.
    bool any_edge(const Tet& tet, const auto& take) {
        if (std::count_if(tet.begin(), tet.end(), [&](std::int32_t n) { return on_surface_[n]; }) <
            4)
            return false;
        for (const auto& [i, j] : tet_edges) {
            const int k = i != 0 && j != 0 ? 0 : i != 1 && j != 1 ? 1 : 2;
            if (take(tet[i], tet[j], tet[k], tet[6 - i - j - k])) return true;
        }
        return false;
    }

    /// Removes a tet with two nearly coplanar faces on the outer boundary.
    bool peel(std::int32_t t) {
        return any_edge(Tet(mesh_.tets[t]), [&](std::int32_t a, std::int32_t b, std::int32_t c,
                                                std::int32_t d) {
            if (!exposed(a, b, c) || !exposed(a, b, d) || on_boundary(c, d) || !flat(a, b, c, d))
                return false;
            remove(t);
            ++report.peeled_tets;
            return true;
        });
    }

    /// Moves a tet with two nearly coplanar faces towards another region to that region, if the
    /// edge between these faces, then an inner edge, can be removed.
    bool hand_over(std::int32_t t) {
        if (mesh_.regions.empty()) return false;
        const auto other_side = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
            const Star both = tets_with({a, b, c});
            return both.size() == 1 ? region(t) : region(both[0] == t ? both[1] : both[0]);
        };
        return any_edge(Tet(mesh_.tets[t]),
                        [&](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
                            const std::int32_t before = region(t), after = other_side(a, b, c);
                            if (after == before || other_side(a, b, d) != after ||
                                on_boundary(c, d) || !flat(a, b, c, d))
                                return false;
                            mesh_.regions[t] = after;
                            if (remove_edge(a, b)) return true;
                            mesh_.regions[t] = before;
                            return false;
                        });
    }

    /// Removes the edge a b and its ring of tets: the best triangulation of the ring's polygon is
    /// joined with a and with b (G. Klincsek, Minimal triangulations of polygonal domains, 1980).
    bool remove_edge(std::int32_t a, std::int32_t b) {
        const Star old = tets_with({a, b});
        const std::size_t n = old.size();
        if (n < 3 || n > max_ring || on_boundary(a, b)) return false;
        // Edges of the ring, oriented as a right-hand screw from a to b.
        std::vector<std::array<std::int32_t, 2>> sides;
        for (const std::int32_t t : old) {
            std::array<std::int32_t, 2> side{};
            std::copy_if(mesh_.tets[t].begin(), mesh_.tets[t].end(), side.begin(),
                         [&](std::int32_t m) { return m != a && m != b; });
            if (shape({a, b, side[0], side[1]}) == inverted) std::swap(side[0], side[1]);
            sides.push_back(side);
        }
        std::vector<std::int32_t> ring{sides[0][0]};
        while (ring.size() < n) {
            const auto next = std::find_if(sides.begin(), sides.end(),
                                           [&](const auto& s) { return s[0] == ring.back(); });
            if (next == sides.end()) return false;
            ring.push_back((*next)[1]);
        }
        double best[max_ring][max_ring];
        std::size_t apex[max_ring][max_ring];
        for (std::size_t i = 0; i + 1 < n; ++i) best[i][i + 1] = 1;
        for (std::size_t width = 2; width < n; ++width)
            for (std::size_t i = 0; i + width < n; ++i) {
                const std::size_t j = i + width;
                best[i][j] = inverted;
                apex[i][j] = i + 1;
                for (std::size_t k = i + 1; k < j; ++k) {
                    const double worst =
                        std::min({best[i][k], best[k][j], shape({ring[i], ring[k], ring[j], b}),
                                  shape({ring[i], ring[j], ring[k], a})});
                    if (worst <= best[i][j]) continue;
                    best[i][j] = worst;
                    apex[i][j] = k;
                }
            }
        std::vector<Tet> fresh;
        std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
        while (!open.empty()) {
            const auto [i, j] = open.back();
            open.pop_back();
            if (j - i < 2) continue;
            const std::size_t k = apex[i][j];
            fresh.push_back({ring[i], ring[k], ring[j], b});
            fresh.push_back({ring[i], ring[j], ring[k], a});
            open.push_back({i, k});
            open.push_back({k, j});
        }
        return replace(old, fresh, report.flips);
    }

    /// Replaces the two tets that share the face opposite to corner i of t by three tets around a
    /// new edge.
    bool swap_face(std::int32_t t, int i) {
        const Tet tet = mesh_.tets[t];
        const std::int32_t a = tet[i];
        std::int32_t p = tet[(i + 1) % 4], q = tet[(i + 2) % 4], r = tet[(i + 3) % 4];
        if (shape({p, q, r, a}) == inverted) std::swap(p, q);
        const Star old = tets_with({p, q, r});
        if (old.size() != 2 || region(old[0]) != region(old[1])) return false;
        const Tet& other = mesh_.tets[old[0] == t ? old[1] : old[0]];
        const std::int32_t b = *std::find_if(
            other.begin(), other.end(), [&](std::int32_t n) { return n != p && n != q && n != r; });
        return replace(old, {{p, q, b, a}, {q, r, b, a}, {r, p, b, a}}, report.flips);
    }

    /// Pattern search for the node position that maximises the smallest angle around the node.
    bool move(std::int32_t n) {
        const Star& star = stars_[n];
        const double scale = mean_edge(mesh_, star, n), start = worst_of(star);
        const Vector3 home = mesh_.nodes[n];
        const std::vector<BoundaryTriangle> boundary = boundary_about(n);
        std::vector<Vector3> normals;
        for (const BoundaryTriangle& f : boundary) normals.push_back(normal(f.nodes));
        std::vector<const NearestTriangle*> guides;
        for (const Patch& patch : patches_of(boundary)) guides.push_back(guide_(patch));
        if (std::find(guides.begin(), guides.end(), nullptr) != guides.end()) return false;
        const auto allowed = [&](Vector3 x) -> Vector3 {
            // At the junction of patches the node is projected onto each in turn, which ends near
            // all of them.
            for (std::size_t turn = 0; turn < (guides.size() > 1 ? 3 : 1); ++turn)
                for (const NearestTriangle* guide : guides) {
                    const Vector3 foot = guide->find(x).place, off = x - foot;
                    x = foot +
                        off * std::min(1.0, crease_slack * scale / std::max(off.norm(), 1e-300));
                }
            return x;
        };
        Vector3 at = home;
        double value = start;
        const auto better = [&](const Vector3& wanted) {
            const Vector3 x = mesh_.nodes[n] = allowed(wanted);
            double worst = 1;
            for (std::size_t f = 0; f < boundary.size(); ++f)
                if (normal(boundary[f].nodes).dot(normals[f]) < min_normal_cosine) worst = inverted;
            for (std::size_t i = 0; i < star.size() && worst > value; ++i)
                worst = std::min(worst, shape(mesh_.tets[star[i]]));
            if (worst < value + min_gain) return false;
            value = worst;
            at = x;
            return true;
        };
        for (double step = 0.3 * scale; step > 0.01 * scale;) {
            bool found = false;
            for (int d = 0; d < 27; ++d)
                found |= better(at + step * Vector3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1));
            if (!found) step /= 2;
        }
        mesh_.nodes[n] = at;
        if (at == home) return false;
        ++report.moves;
        return true;
    }

    std::vector<std::int32_t> neighbours(std::int32_t n) const {
        std::vector<std::int32_t> found;
        for (const std::int32_t t : stars_[n])
            found.insert(found.end(), mesh_.tets[t].begin(), mesh_.tets[t].end());
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        return found;
    }

    /// Number of nodes that boundary edges connect to both nodes.
    std::size_t shared_boundary_neighbours(std::int32_t a, std::int32_t b) const {
        std::array<std::vector<std::int32_t>, 2> near;
        for (const int side : {0, 1}) {
            const std::int32_t n = side == 0 ? a : b;
            for (const BoundaryTriangle& f : boundary_about(n))
                for (const std::int32_t corner : f.nodes)
                    if (corner != n) near[side].push_back(corner);
            std::sort(near[side].begin(), near[side].end());
            near[side].erase(std::unique(near[side].begin(), near[side].end()), near[side].end());
        }
        std::vector<std::int32_t> shared;
        std::set_intersection(near[0].begin(), near[0].end(), near[1].begin(), near[1].end(),
                              std::back_inserter(shared));
        return shared.size();
    }

    /// Collapses node `from` into `to`. A boundary node moves along a boundary edge and must not
    /// turn the surface around it; a node where more than two regions meet is kept.
    bool collapse(std::int32_t from, std::int32_t to) {
        if (on_surface_[from] && !on_boundary(from, to)) return false;
        const Star gone = tets_with({from, to});
        // Link condition: every common neighbour must share a tet with the edge.
        std::vector<std::int32_t> near_from = neighbours(from), near_to = neighbours(to), both,
                                  ring;
        std::set_intersection(near_from.begin(), near_from.end(), near_to.begin(), near_to.end(),
                              std::back_inserter(both));
        for (const std::int32_t t : gone)
            ring.insert(ring.end(), mesh_.tets[t].begin(), mesh_.tets[t].end());
        std::sort(ring.begin(), ring.end());
        ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
        if (both != ring) return false;
        const std::vector<BoundaryTriangle> boundary = boundary_about(from);
        if (patches_of(boundary).size() > 1) return false;
        // The same on the boundary, so that a narrow neck is not pinched.
        if (on_surface_[from] && shared_boundary_neighbours(from, to) != 2) return false;
        const auto drawn = [&](auto corners) {
            std::replace(corners.begin(), corners.end(), from, to);
            return corners;
        };
        for (const auto& [f, patch] : boundary)
            if (std::find(f.begin(), f.end(), to) == f.end() &&
                normal(drawn(f)).dot(normal(f)) < 0.9)
                return false;
        std::vector<Tet> fresh;
        std::vector<std::int32_t> regions;
        for (const std::int32_t t : stars_[from]) {
            if (has(mesh_.tets[t], to)) continue;
            fresh.push_back(drawn(mesh_.tets[t]));
            regions.push_back(region(t));
        }
        return !fresh.empty() && replace(Star(stars_[from]), fresh, report.collapses, regions);
    }

    void compact() {
        std::size_t kept = 0;
        for (std::size_t t = 0; t < mesh_.tets.size(); ++t)
            if (alive_[t]) {
                if (!mesh_.regions.empty()) mesh_.regions[kept] = mesh_.regions[t];
                mesh_.tets[kept++] = mesh_.tets[t];
            }
        mesh_.tets.resize(kept);
        if (!mesh_.regions.empty()) mesh_.regions.resize(kept);
        drop_unused_nodes(mesh_);
    }

    TetMesh& mesh_;
    Guide guide_;
    double aim_;
    std::vector<bool> alive_;
    std::vector<Star> stars_;
    std::vector<bool> on_surface_;
};

}  // namespace

OptimiseReport raise_dihedral_angles(TetMesh& mesh, const NearestTriangle& body, double aim_deg) {
    mesh.regions.clear();
    Optimiser optimiser(
        mesh, [&](const Patch&) { return &body; }, aim_deg);
    optimiser.run();
    return optimiser.report;
}

OptimiseReport raise_dihedral_angles(TetMesh& mesh, double aim_deg) {
    std::map<Patch, std::vector<Triangle>> triangles;
    for (const InterfaceTriangle& f : interface_triangles(mesh))
        triangles[patch_of(f.inside, f.outside)].push_back(f.nodes);
    std::map<Patch, NearestTriangle> trees;
    for (const auto& [patch, its] : triangles)
        trees.emplace(patch, NearestTriangle(mesh.nodes, its));
    const auto guide = [&](const Patch& patch) {
        const auto found = trees.find(patch);
        return found == trees.end() ? nullptr : &found->second;
    };
    Optimiser optimiser(mesh, guide, aim_deg);
    optimiser.run();
    return optimiser.report;
}

}  // namespace livetet
