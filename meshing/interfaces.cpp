#include "meshing/interfaces.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "mesh/tet_faces.hpp"
#include "meshing/quality.hpp"
#include "meshing/stars.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

constexpr double max_step = 0.1;  ///< of a node's mean edge

struct Face {
    Triangle sorted;
    std::int32_t tet;
    int side;
};

/// All faces of all tets, sorted so that equal faces are adjacent.
std::vector<Face> sorted_faces(const TetMesh& mesh) {
    std::vector<Face> all;
    all.reserve(4 * mesh.tets.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        for (int side = 0; side < 4; ++side) {
            Triangle f;
            for (int c = 0; c < 3; ++c) f[c] = mesh.tets[t][tet_faces[side][c]];
            std::sort(f.begin(), f.end());
            all.push_back({f, static_cast<std::int32_t>(t), side});
        }
    std::sort(all.begin(), all.end(), [](const Face& a, const Face& b) {
        return a.sorted != b.sorted ? a.sorted < b.sorted : a.tet < b.tet;
    });
    return all;
}

/// The tet behind each face of each tet; -1: none.
std::vector<std::array<std::int32_t, 4>> neighbours_of(const TetMesh& mesh) {
    std::vector<std::array<std::int32_t, 4>> next(mesh.tets.size(), {-1, -1, -1, -1});
    const std::vector<Face> all = sorted_faces(mesh);
    for (std::size_t f = 0; f + 1 < all.size(); ++f)
        if (all[f].sorted == all[f + 1].sorted) {
            next[all[f].tet][all[f].side] = all[f + 1].tet;
            next[all[f + 1].tet][all[f + 1].side] = all[f].tet;
        }
    return next;
}

/// Implementation of `make_one_body`.
class BodyCutter {
  public:
    BodyCutter(TetMesh& mesh, const KeptPieces& kept)
        : mesh_(mesh), kept_(kept), next_(neighbours_of(mesh)), stars_(stars_of(mesh)) {}

    void run() {
        constexpr int max_rounds = 30;
        for (int round = 0; round < max_rounds; ++round) {
            bool changed = cut_small_pieces();
            changed |= fill_hollows();
            for (std::size_t n = 0; n < stars_.size(); ++n)
                if (mend(static_cast<std::int32_t>(n))) {
                    changed = true;
                    last_ = static_cast<std::int32_t>(n);
                }
            if (!changed) return;
        }
        fail("the labels' tets touch themselves at {}, whatever is cut or filled",
             place_mm(mesh_.nodes[last_]));
    }

  private:
    using Piece = std::vector<std::int32_t>;

    bool in_body(std::int32_t t) const { return mesh_.regions[t] != 0; }

    double volume_of(const Piece& piece) const {
        double sum = 0;
        for (const std::int32_t t : piece) sum += std::abs(signed_volume(mesh_, mesh_.tets[t]));
        return sum;
    }

    /// The tets connected to `seed` by faces for which `allowed` holds; all in the body or all
    /// outside.
    Piece flood(std::int32_t seed, std::vector<bool>& seen, const auto& allowed) const {
        Piece piece{seed};
        seen[seed] = true;
        for (std::size_t i = 0; i < piece.size(); ++i)
            for (int side = 0; side < 4; ++side) {
                const std::int32_t next = next_[piece[i]][side];
                if (next < 0 || seen[next] || in_body(next) != in_body(seed) ||
                    !allowed(piece[i], side))
                    continue;
                seen[next] = true;
                piece.push_back(next);
            }
        return piece;
    }

    std::vector<Piece> pieces(bool of_body) const {
        std::vector<Piece> found;
        std::vector<bool> seen(mesh_.tets.size(), false);
        for (std::size_t t = 0; t < seen.size(); ++t)
            if (!seen[t] && in_body(static_cast<std::int32_t>(t)) == of_body)
                found.push_back(flood(static_cast<std::int32_t>(t), seen,
                                      [](std::int32_t, int) { return true; }));
        return found;
    }

    bool cut_small_pieces() {
        const std::vector<Piece> all = pieces(true);
        if (all.empty()) fail("the labels' tets: there are none, edges are too long for the body");
        std::vector<double> volumes;
        for (const Piece& piece : all) volumes.push_back(volume_of(piece));
        const auto largest = static_cast<std::size_t>(
            std::max_element(volumes.begin(), volumes.end()) - volumes.begin());
        bool changed = false;
        for (std::size_t p = 0; p < all.size(); ++p) {
            if (p == largest || volumes[p] >= kept_.part_m3) continue;
            cut(all[p]);
            changed = true;
        }
        return changed;
    }

    bool reaches_out(const Piece& piece) const {
        return std::any_of(piece.begin(), piece.end(), [&](std::int32_t t) {
            return std::find(next_[t].begin(), next_[t].end(), -1) != next_[t].end();
        });
    }

    bool fill_hollows() {
        bool changed = false;
        for (const Piece& piece : pieces(false))
            if (!reaches_out(piece) && volume_of(piece) < kept_.cavity_m3) {
                fill(piece);
                changed = true;
            }
        return changed;
    }

    void cut(const Piece& piece) {
        for (const std::int32_t t : piece) mesh_.regions[t] = 0;
    }

    /// Gives each tet the region of a tet behind one of its faces.
    void fill(const Piece& piece) {
        for (std::size_t left = piece.size(), before = 0; left != before;) {
            before = left;
            left = 0;
            for (const std::int32_t t : piece) {
                for (const std::int32_t next : next_[t])
                    if (!in_body(t) && next >= 0 && in_body(next))
                        mesh_.regions[t] = mesh_.regions[next];
                if (!in_body(t)) ++left;
            }
        }
    }

    /// The body is manifold at a node if the node's tets inside are connected by faces at the node,
    /// and so are those outside.
    bool mend(std::int32_t n) {
        const auto& star = stars_[n];
        const auto body_count =
            std::count_if(star.begin(), star.end(), [&](std::int32_t t) { return in_body(t); });
        if (body_count == 0 || static_cast<std::size_t>(body_count) == star.size()) return false;
        std::vector<Piece> inside, outside;
        std::vector<std::int32_t> seen;
        const auto at_node = [&](std::int32_t t, int side) { return mesh_.tets[t][side] != n; };
        for (const std::int32_t t : star) {
            if (std::find(seen.begin(), seen.end(), t) != seen.end()) continue;
            Piece piece = flood_star(t, at_node);
            seen.insert(seen.end(), piece.begin(), piece.end());
            (in_body(t) ? inside : outside).push_back(std::move(piece));
        }
        // Tets at the convex hull are connected through the outside of the hull.
        const auto at_hull = [&](const Piece& piece) {
            return std::any_of(piece.begin(), piece.end(), [&](std::int32_t t) {
                for (int side = 0; side < 4; ++side)
                    if (next_[t][side] < 0 && at_node(t, side)) return true;
                return false;
            });
        };
        const auto by_volume = [&](const Piece& a, const Piece& b) {
            return volume_of(a) > volume_of(b);
        };
        std::sort(inside.begin(), inside.end(), by_volume);
        for (std::size_t p = 1; p < inside.size(); ++p) cut(inside[p]);
        if (inside.size() > 1) return true;
        std::sort(outside.begin(), outside.end(), [&](const Piece& a, const Piece& b) {
            return at_hull(a) != at_hull(b) ? at_hull(a) : by_volume(a, b);
        });
        bool changed = false;
        for (std::size_t p = 1; p < outside.size(); ++p) {
            if (at_hull(outside[p])) continue;
            changed = true;
            if (volume_of(outside[p]) > volume_of(inside[0])) {
                cut(inside[0]);
                break;
            }
            fill(outside[p]);
        }
        return changed;
    }

    Piece flood_star(std::int32_t seed, const auto& at_node) const {
        Piece piece{seed};
        for (std::size_t i = 0; i < piece.size(); ++i)
            for (int side = 0; side < 4; ++side) {
                const std::int32_t next = next_[piece[i]][side];
                if (next >= 0 && at_node(piece[i], side) && in_body(next) == in_body(seed) &&
                    std::find(piece.begin(), piece.end(), next) == piece.end())
                    piece.push_back(next);
            }
        return piece;
    }

    TetMesh& mesh_;
    KeptPieces kept_;
    std::vector<std::array<std::int32_t, 4>> next_;
    std::vector<Star> stars_;
    std::int32_t last_ = 0;
};

double min_angle(const TetMesh& mesh, const Star& star) {
    double angle_deg = 180;
    for (const std::int32_t t : star) {
        const auto& [a, b, c, d] = mesh.tets[t];
        if (!(signed_volume(mesh, mesh.tets[t]) > 0)) return -1;
        const auto angles =
            dihedral_angles_deg(mesh.nodes[a], mesh.nodes[b], mesh.nodes[c], mesh.nodes[d]);
        angle_deg = std::min(angle_deg, *std::min_element(angles.begin(), angles.end()));
    }
    return angle_deg;
}

}  // namespace

std::vector<InterfaceTriangle> interface_triangles(const TetMesh& mesh) {
    const std::vector<Face> all = sorted_faces(mesh);
    const auto region = [&](std::int32_t t) { return mesh.regions.empty() ? 1 : mesh.regions[t]; };
    std::vector<Face> kept;
    std::vector<std::int32_t> outside;
    for (std::size_t i = 0; i < all.size();) {
        const bool paired = i + 1 < all.size() && all[i].sorted == all[i + 1].sorted;
        if (!paired) {
            kept.push_back({{}, all[i].tet, all[i].side});
        } else if (const auto a = region(all[i].tet), b = region(all[i + 1].tet); a != b) {
            const Face& inner = all[a < b ? i : i + 1];
            kept.push_back({{std::max(a, b), 0, 0}, inner.tet, inner.side});
        }
        i += paired ? 2 : 1;
    }
    std::sort(kept.begin(), kept.end(), [](const Face& a, const Face& b) {
        return a.tet != b.tet ? a.tet < b.tet : a.side < b.side;
    });
    std::vector<InterfaceTriangle> triangles;
    for (const Face& f : kept) {
        InterfaceTriangle& t = triangles.emplace_back();
        for (int c = 0; c < 3; ++c) t.nodes[c] = mesh.tets[f.tet][tet_faces[f.side][c]];
        t.inside = region(f.tet);
        t.outside = f.sorted[0];
    }
    return triangles;
}

std::map<std::int32_t, double> region_volumes(const TetMesh& mesh) {
    std::map<std::int32_t, double> volumes;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        volumes[mesh.regions.empty() ? 1 : mesh.regions[t]] += signed_volume(mesh, mesh.tets[t]);
    return volumes;
}

void keep_region_volumes(TetMesh& mesh, const std::map<std::int32_t, double>& wanted_m3,
                         double min_deg, int steps) {
    const std::vector<InterfaceTriangle> triangles = interface_triangles(mesh);
    const auto stars = stars_of(mesh);
    std::map<std::int32_t, int> row;
    for (const auto& [region, volume] : region_volumes(mesh))
        if (wanted_m3.contains(region)) row.emplace(region, static_cast<int>(row.size()));
    struct Gradient {
        int row;
        Vector3 by_node;
    };
    for (int step = 0; step < steps; ++step) {
        std::vector<std::vector<Gradient>> gradients(mesh.nodes.size());
        std::vector<double> area(mesh.nodes.size(), 0);
        const auto add = [&](std::int32_t n, std::int32_t region, const Vector3& g) {
            const auto at = row.find(region);
            if (at == row.end()) return;
            auto& list = gradients[n];
            const auto found = std::find_if(list.begin(), list.end(),
                                            [&](const auto& e) { return e.row == at->second; });
            found == list.end() ? list.push_back({at->second, g}) : void(found->by_node += g);
        };
        for (const InterfaceTriangle& f : triangles) {
            const Vector3& a = mesh.nodes[f.nodes[0]];
            const Vector3 third =
                (mesh.nodes[f.nodes[1]] - a).cross(mesh.nodes[f.nodes[2]] - a) / 6;
            for (const std::int32_t n : f.nodes) {
                area[n] += third.norm();
                add(n, f.inside, third);
                add(n, f.outside, -third);
            }
        }
        Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(row.size(), row.size());
        Eigen::VectorXd missing(row.size());
        for (std::size_t n = 0; n < gradients.size(); ++n)
            for (const Gradient& a : gradients[n])
                for (const Gradient& b : gradients[n])
                    matrix(a.row, b.row) += a.by_node.dot(b.by_node) / area[n];
        const auto volumes = region_volumes(mesh);
        for (const auto& [region, r] : row) missing[r] = wanted_m3.at(region) - volumes.at(region);
        matrix.diagonal() *= 1 + 1e-9;
        const Eigen::VectorXd p = matrix.ldlt().solve(missing);
        if (!p.allFinite()) return;
        for (std::size_t n = 0; n < gradients.size(); ++n) {
            Vector3 shift = Vector3::Zero();
            for (const Gradient& a : gradients[n]) shift += p[a.row] * a.by_node / area[n];
            if (shift.isZero(0)) continue;
            const double longest =
                max_step * mean_edge(mesh, stars[n], static_cast<std::int32_t>(n));
            shift *= std::min(1.0, longest / shift.norm());
            const double bound = std::min(min_deg, min_angle(mesh, stars[n]));
            const Vector3 home = mesh.nodes[n];
            for (int halving = 0; halving < 4; ++halving, shift /= 2) {
                mesh.nodes[n] = home + shift;
                if (min_angle(mesh, stars[n]) >= bound) break;
                mesh.nodes[n] = home;
            }
        }
    }
}

void make_one_body(TetMesh& mesh, const KeptPieces& kept) {
    BodyCutter(mesh, kept).run();
    std::size_t left = 0;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        if (mesh.regions[t] != 0) {
            mesh.regions[left] = mesh.regions[t];
            mesh.tets[left++] = mesh.tets[t];
        }
    mesh.tets.resize(left);
    mesh.regions.resize(left);
    drop_unused_nodes(mesh);
}

}  // namespace livetet
