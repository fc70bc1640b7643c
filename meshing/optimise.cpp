#include "meshing/optimise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "meshing/quality.hpp"

namespace livetet {

namespace {

using Star = std::vector<std::int32_t>;

constexpr int most_passes = 12;
constexpr double crease_slack = 0.05;   ///< of a node's mean edge: how far it may leave the body's surface
constexpr double turned_normal = 0.5;   ///< cosine: a boundary triangle may not turn further in one move
constexpr std::size_t widest_ring = 7;  ///< tets about an edge that is removed
constexpr double least_gain = 1e-4;     ///< of `shape`, for a move to be worth it
constexpr double inverted = -2;         ///< worse than any angle

/// Minus the cosine of the least dihedral angle, which grows with it; `inverted` for no or negative volume. The outward
/// normals n_i, n_j of two faces make the angle acos(-n_i . n_j).
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

class Optimiser {
  public:
    Optimiser(TetMesh& mesh, const NearestTriangle& body, double aim_deg)
        : mesh_(mesh),
          body_(body),
          aim_(-std::cos(aim_deg * std::numbers::pi / 180)),
          alive_(mesh.tets.size(), true),
          stars_(mesh.nodes.size()),
          on_surface_(mesh.nodes.size(), false) {
        for (std::size_t t = 0; t < mesh.tets.size(); ++t)
            for (const std::int32_t n : mesh.tets[t]) stars_[n].push_back(static_cast<std::int32_t>(t));
        for (const std::int32_t n : nodes_of(boundary_triangles(mesh.tets))) on_surface_[n] = true;
    }

    void run() {
        for (int pass = 0; pass < most_passes; ++pass) {
            Star poor;
            for (std::size_t t = 0; t < mesh_.tets.size(); ++t)
                if (alive_[t] && shape(mesh_.tets[t]) < aim_) poor.push_back(static_cast<std::int32_t>(t));
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
        return livetet::shape(mesh_.nodes[t[0]], mesh_.nodes[t[1]], mesh_.nodes[t[2]], mesh_.nodes[t[3]]);
    }

    double worst_of(const Star& tets) const {
        double worst = 1;
        for (const std::int32_t t : tets) worst = std::min(worst, shape(mesh_.tets[t]));
        return worst;
    }

    static bool has(const Tet& t, std::int32_t n) { return std::find(t.begin(), t.end(), n) != t.end(); }

    /// The tets that hold all of these nodes.
    Star tets_with(std::initializer_list<std::int32_t> nodes) const {
        Star found;
        for (const std::int32_t t : stars_[*nodes.begin()])
            if (std::all_of(nodes.begin(), nodes.end(), [&](std::int32_t n) { return has(mesh_.tets[t], n); }))
                found.push_back(t);
        return found;
    }

    bool on_boundary(std::int32_t a, std::int32_t b, std::int32_t c) const { return tets_with({a, b, c}).size() == 1; }

    /// Whether a boundary triangle has the edge.
    bool on_boundary(std::int32_t a, std::int32_t b) const {
        if (!on_surface_[a] || !on_surface_[b]) return false;
        for (const std::int32_t t : tets_with({a, b}))
            for (const std::int32_t c : mesh_.tets[t])
                if (c != a && c != b && on_boundary(a, b, c)) return true;
        return false;
    }

    /// The boundary triangles of a node, as they are wound.
    std::vector<Triangle> boundary_about(std::int32_t n) const {
        std::vector<Triangle> found;
        if (!on_surface_[n]) return found;
        for (const std::int32_t t : stars_[n]) {
            const auto& [a, b, c, d] = mesh_.tets[t];
            for (const Triangle& f : {Triangle{b, c, d}, Triangle{a, d, c}, Triangle{a, b, d}, Triangle{a, c, b}})
                if ((f[0] == n || f[1] == n || f[2] == n) && on_boundary(f[0], f[1], f[2])) found.push_back(f);
        }
        return found;
    }

    Vector3 normal(const Triangle& f) const {
        const Vector3& a = mesh_.nodes[f[0]];
        return (mesh_.nodes[f[1]] - a).cross(mesh_.nodes[f[2]] - a).normalized();
    }

    double mean_edge(std::int32_t n) const {
        double sum = 0;
        for (const std::int32_t t : stars_[n])
            for (const std::int32_t m : mesh_.tets[t]) sum += (mesh_.nodes[m] - mesh_.nodes[n]).norm();
        return sum / (3.0 * static_cast<double>(stars_[n].size()));
    }

    void add(const Tet& tet) {
        for (const std::int32_t n : tet) stars_[n].push_back(static_cast<std::int32_t>(mesh_.tets.size()));
        mesh_.tets.push_back(tet);
        alive_.push_back(true);
    }

    void remove(std::int32_t t) {
        alive_[t] = false;
        for (const std::int32_t n : mesh_.tets[t]) std::erase(stars_[n], t);
    }

    /// Puts `fresh` in the place of `old` if their least angle is greater.
    bool replace(const Star& old, const std::vector<Tet>& fresh, std::int64_t& count) {
        const double worst = worst_of(old);
        for (const Tet& t : fresh)
            if (shape(t) <= worst) return false;
        for (const std::int32_t t : old) remove(t);
        for (const Tet& t : fresh) add(t);
        ++count;
        return true;
    }

    bool improve(std::int32_t t) {
        const Tet tet = mesh_.tets[t];
        if (peel(t)) return true;
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

    /// Leaves out a tet whose two faces on the boundary are nearly in one plane.
    bool peel(std::int32_t t) {
        const Tet tet = mesh_.tets[t];
        for (const auto& [i, j] : tet_edges) {
            const int k = i != 0 && j != 0 ? 0 : i != 1 && j != 1 ? 1 : 2;
            const int l = 6 - i - j - k;
            const std::int32_t a = tet[i], b = tet[j], c = tet[k], d = tet[l];
            if (!on_surface_[a] || !on_surface_[b] || !on_surface_[c] || !on_surface_[d]) continue;
            if (!on_boundary(a, b, c) || !on_boundary(a, b, d) || on_boundary(c, d)) continue;
            const Vector3 ab = mesh_.nodes[b] - mesh_.nodes[a], cd = mesh_.nodes[d] - mesh_.nodes[c];
            const Vector3 across = ab.cross(cd).normalized();
            const double thickness = std::abs(across.dot(mesh_.nodes[c] - mesh_.nodes[a]));
            if (thickness > crease_slack * (ab.norm() + cd.norm())) continue;
            remove(t);
            ++report.peeled_tets;
            return true;
        }
        return false;
    }

    /// Takes the edge a b and the tets about it away: the best triangles of their ring's polygon are joined with a and
    /// with b (G. Klincsek, Minimal triangulations of polygonal domains, 1980).
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
            const auto next =
                std::find_if(sides.begin(), sides.end(), [&](const auto& s) { return s[0] == ring.back(); });
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
                    const double worst = std::min({best[i][k], best[k][j], shape({ring[i], ring[k], ring[j], b}),
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

    /// Three tets about a new edge in the place of two that share the face opposite to corner i of t.
    bool swap_face(std::int32_t t, int i) {
        const Tet tet = mesh_.tets[t];
        const std::int32_t a = tet[i];
        std::int32_t p = tet[(i + 1) % 4], q = tet[(i + 2) % 4], r = tet[(i + 3) % 4];
        if (shape({p, q, r, a}) == inverted) std::swap(p, q);
        const Star old = tets_with({p, q, r});
        if (old.size() != 2) return false;
        const Tet& other = mesh_.tets[old[0] == t ? old[1] : old[0]];
        const std::int32_t b =
            *std::find_if(other.begin(), other.end(), [&](std::int32_t n) { return n != p && n != q && n != r; });
        return replace(old, {{p, q, b, a}, {q, r, b, a}, {r, p, b, a}}, report.flips);
    }

    /// A pattern search for the place of a node where the least angle about it is greatest.
    bool move(std::int32_t n) {
        const Star& star = stars_[n];
        const double scale = mean_edge(n), start = worst_of(star);
        const Vector3 home = mesh_.nodes[n];
        const std::vector<Triangle> boundary = boundary_about(n);
        std::vector<Vector3> normals;
        for (const Triangle& f : boundary) normals.push_back(normal(f));
        const auto allowed = [&](const Vector3& x) -> Vector3 {
            if (boundary.empty()) return x;
            const Vector3 foot = body_.find(x).place, off = x - foot;
            return foot + off * std::min(1.0, crease_slack * scale / std::max(off.norm(), 1e-300));
        };
        Vector3 at = home;
        double value = start;
        const auto better = [&](const Vector3& wanted) {
            const Vector3 x = mesh_.nodes[n] = allowed(wanted);
            double worst = 1;
            for (std::size_t f = 0; f < boundary.size(); ++f)
                if (normal(boundary[f]).dot(normals[f]) < turned_normal) worst = inverted;
            for (std::size_t i = 0; i < star.size() && worst > value; ++i)
                worst = std::min(worst, shape(mesh_.tets[star[i]]));
            if (worst < value + least_gain) return false;
            value = worst;
            at = x;
            return true;
        };
        for (double step = 0.3 * scale; step > 0.01 * scale;) {
            bool found = false;
            for (int d = 0; d < 27; ++d) found |= better(at + step * Vector3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1));
            if (!found) step /= 2;
        }
        mesh_.nodes[n] = at;
        if (at == home) return false;
        ++report.moves;
        return true;
    }

    std::vector<std::int32_t> neighbours(std::int32_t n) const {
        std::vector<std::int32_t> found;
        for (const std::int32_t t : stars_[n]) found.insert(found.end(), mesh_.tets[t].begin(), mesh_.tets[t].end());
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        return found;
    }

    /// How many nodes boundary edges join to both.
    std::size_t shared_boundary_neighbours(std::int32_t a, std::int32_t b) const {
        std::array<std::vector<std::int32_t>, 2> near;
        for (const int side : {0, 1}) {
            const std::int32_t n = side == 0 ? a : b;
            for (const Triangle& f : boundary_about(n))
                for (const std::int32_t corner : f)
                    if (corner != n) near[side].push_back(corner);
            std::sort(near[side].begin(), near[side].end());
            near[side].erase(std::unique(near[side].begin(), near[side].end()), near[side].end());
        }
        std::vector<std::int32_t> shared;
        std::set_intersection(near[0].begin(), near[0].end(), near[1].begin(), near[1].end(), std::back_inserter(shared));
        return shared.size();
    }

    /// Draws node `from` onto `to`. One on the boundary goes along a boundary edge, without turning the surface about
    /// it.
    bool collapse(std::int32_t from, std::int32_t to) {
        if (on_surface_[from] && !on_boundary(from, to)) return false;
        const Star gone = tets_with({from, to});
        // The link condition: who is near both is on a tet of the edge.
        std::vector<std::int32_t> near_from = neighbours(from), near_to = neighbours(to), both, ring;
        std::set_intersection(near_from.begin(), near_from.end(), near_to.begin(), near_to.end(),
                              std::back_inserter(both));
        for (const std::int32_t t : gone) ring.insert(ring.end(), mesh_.tets[t].begin(), mesh_.tets[t].end());
        std::sort(ring.begin(), ring.end());
        ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
        if (both != ring) return false;
        // And on the boundary: else a narrow neck would be pinched.
        if (on_surface_[from] && shared_boundary_neighbours(from, to) != 2) return false;
        const auto drawn = [&](auto corners) {
            std::replace(corners.begin(), corners.end(), from, to);
            return corners;
        };
        for (const Triangle& f : boundary_about(from))
            if (std::find(f.begin(), f.end(), to) == f.end() && normal(drawn(f)).dot(normal(f)) < 0.9) return false;
        std::vector<Tet> fresh;
        for (const std::int32_t t : stars_[from])
            if (!has(mesh_.tets[t], to)) fresh.push_back(drawn(mesh_.tets[t]));
        return !fresh.empty() && replace(Star(stars_[from]), fresh, report.collapses);
    }

    void compact() {
        std::size_t kept = 0;
        for (std::size_t t = 0; t < mesh_.tets.size(); ++t)
            if (alive_[t]) mesh_.tets[kept++] = mesh_.tets[t];
        mesh_.tets.resize(kept);
        std::vector<std::int32_t> number(mesh_.nodes.size(), -1);
        std::int32_t count = 0;
        for (std::size_t n = 0; n < mesh_.nodes.size(); ++n)
            if (!stars_[n].empty()) {
                mesh_.nodes[count] = mesh_.nodes[n];
                number[n] = count++;
            }
        mesh_.nodes.resize(count);
        for (Tet& t : mesh_.tets)
            for (std::int32_t& n : t) n = number[n];
    }

    TetMesh& mesh_;
    const NearestTriangle& body_;
    double aim_;
    std::vector<bool> alive_;
    std::vector<Star> stars_;
    std::vector<bool> on_surface_;
};

}  // namespace

OptimiseReport raise_dihedral_angles(TetMesh& mesh, const NearestTriangle& body, double aim_deg) {
    Optimiser optimiser(mesh, body, aim_deg);
    optimiser.run();
    return optimiser.report;
}

}  // namespace livetet
