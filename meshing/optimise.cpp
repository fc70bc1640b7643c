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
constexpr double crease_slack =
    0.05;  ///< of a node's mean edge: how far it may leave the body's surface
constexpr double turned_normal =
    0.5;  ///< cosine: a boundary triangle may not turn further in one move
constexpr std::size_t widest_ring = 7;  ///< tets about an edge that is removed
constexpr double min_gain = 1e-4;       ///< of `shape`, for a move to be worth it
constexpr double inverted = -2;         ///< worse than any angle

/// Minus the cosine of the least dihedral angle, which grows with it; `inverted` for no or negative
/// volume. The outward normals n_i, n_j of two faces make the angle acos(-n_i . n_j).
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

/// The regions on the two sides of an interface, the lower first.
using Patch = std::array<std::int32_t, 2>;

Patch patch_of(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The surface that the nodes of a patch stay near; none: they stay where they are.
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

    /// The tets that hold all of these nodes.
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

    /// Whether a region ends at the triangle.
    bool on_boundary(std::int32_t a, std::int32_t b, std::int32_t c) const {
        const Star both = tets_with({a, b, c});
        return both.size() == 1 || region(both[0]) != region(both[1]);
    }

    /// Whether a boundary triangle has the edge.
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

    /// The boundary triangles of a node.
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

    /// Puts `fresh` in the place of `old` if their least angle is greater; `regions`: theirs, where
    /// those of `old` differ.
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

    /// Whether a tet is so flat that its faces with edge a b and those with edge c d are nearly in
    /// one plane.
    bool flat(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) const {
        const Vector3 ab = mesh_.nodes[b] - mesh_.nodes[a], cd = mesh_.nodes[d] - mesh_.nodes[c];
        const Vector3 across = ab.cross(cd).normalized();
        return std::abs(across.dot(mesh_.nodes[c] - mesh_.nodes[a])) <=
               crease_slack * (ab.norm() + cd.norm());
    }

    /// Asks `take` with the nodes a, b, c, d of the tet for each of its edges a b, the others
    /// behind, until it is true.
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

    /// Leaves out a tet whose two faces on the boundary of the whole are nearly in one plane.
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

    /// Gives a tet whose two faces towards another region are nearly in one plane to that region,
    /// if the edge between them, which then lies inside of it, can be removed.
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

    /// Takes the edge a b and the tets about it away: the best triangles of their ring's polygon
    /// are joined with a and with b (G. Klincsek, Minimal triangulations of polygonal domains,
    /// 1980).
    bool remove_edge(std::int32_t a, std::int32_t b) {
        const Star old = tets_with({a, b});
        const std::size_t n = old.size();
        if (n < 3 || n > widest_ring || on_boundary(a, b)) return false;
        std::vector<std::array<std::int32_t, 2>>
            sides;  // of the ring, each turning from a to b like a right-hand screw
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
        double best[widest_ring][widest_ring];
        std::size_t apex[widest_ring][widest_ring];
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

    /// Three tets about a new edge in the place of two that share the face opposite to corner i of
    /// t.
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

    /// A pattern search for the place of a node where the least angle about it is greatest.
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
            // Where patches meet a node is led to each in turn, which ends near all of them.
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
                if (normal(boundary[f].nodes).dot(normals[f]) < turned_normal) worst = inverted;
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

    /// How many nodes boundary edges join to both.
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

    /// Draws node `from` onto `to`. One on the boundary goes along a boundary edge, without turning
    /// the surface about it; one where more than two regions meet stays.
    bool collapse(std::int32_t from, std::int32_t to) {
        if (on_surface_[from] && !on_boundary(from, to)) return false;
        const Star gone = tets_with({from, to});
        // The link condition: who is near both is on a tet of the edge.
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
        // And on the boundary: else a narrow neck would be pinched.
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
