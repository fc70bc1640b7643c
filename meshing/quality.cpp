#include "meshing/quality.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "meshing/surface_check.hpp"

namespace livetet {

double radius_ratio(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    const double volume = std::abs((b - a).dot((c - a).cross(d - a))) / 6;
    const double area = ((b - a).cross(c - a).norm() + (b - a).cross(d - a).norm() +
                         (c - a).cross(d - a).norm() + (c - b).cross(d - b).norm()) /
                        2;
    const double p = (b - a).norm() * (d - c).norm();
    const double q = (c - a).norm() * (d - b).norm();
    const double r = (d - a).norm() * (c - b).norm();
    const double product = (p + q + r) * (p + q - r) * (p - q + r) * (-p + q + r);
    if (!(volume > 0) || !(product > 0)) return 0;
    const double inscribed = 3 * volume / area;
    const double circumscribed = std::sqrt(product) / (24 * volume);
    return 3 * inscribed / circumscribed;
}

std::array<double, 6> dihedral_angles_deg(const Vector3& a, const Vector3& b, const Vector3& c,
                                          const Vector3& d) {
    // Angle at the edge p-q between the half-planes towards r and s.
    const auto angle = [](const Vector3& p, const Vector3& q, const Vector3& r, const Vector3& s) {
        const Vector3 m = (q - p).cross(r - p), n = (q - p).cross(s - p);
        return std::atan2(m.cross(n).norm(), m.dot(n)) * 180 / std::numbers::pi;
    };
    return {angle(a, b, c, d), angle(a, c, b, d), angle(a, d, b, c),
            angle(b, c, a, d), angle(b, d, a, c), angle(c, d, a, b)};
}

MeshQuality measure_quality(const TetMesh& mesh) {
    MeshQuality q;
    q.nodes = static_cast<std::int64_t>(mesh.nodes.size());
    q.tets = static_cast<std::int64_t>(mesh.tets.size());
    q.boundary_triangles = static_cast<std::int64_t>(boundary_triangles(mesh.tets).size());
    q.volume_m3 = volume(mesh);
    q.min_edge_m = q.min_radius_ratio = std::numeric_limits<double>::infinity();
    double edges = 0, ratios = 0;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Tet& t = mesh.tets[e];
        const Vector3 &a = mesh.nodes[t[0]], &b = mesh.nodes[t[1]], &c = mesh.nodes[t[2]],
                      &d = mesh.nodes[t[3]];
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < i; ++j) {
                const double length = (mesh.nodes[t[i]] - mesh.nodes[t[j]]).norm();
                q.min_edge_m = std::min(q.min_edge_m, length);
                q.max_edge_m = std::max(q.max_edge_m, length);
                edges += length;
            }
        const auto angles = dihedral_angles_deg(a, b, c, d);
        for (const double angle : angles)
            ++q.dihedral_counts[std::min<std::size_t>(static_cast<std::size_t>(angle / 10),
                                                      q.dihedral_counts.size() - 1)];
        const auto [min_angle, max_angle] = std::minmax_element(angles.begin(), angles.end());
        q.max_dihedral_deg = std::max(q.max_dihedral_deg, *max_angle);
        const double ratio = radius_ratio(a, b, c, d);
        ratios += ratio;
        q.min_radius_ratio = std::min(q.min_radius_ratio, ratio);
        if (q.worst.size() == q.worst_listed && *min_angle >= q.worst.back().min_dihedral_deg)
            continue;
        const MeshQuality::WorstTet tet{static_cast<std::int64_t>(e), *min_angle, ratio,
                                        (a + b + c + d) / 4};
        q.worst.insert(std::upper_bound(q.worst.begin(), q.worst.end(), tet,
                                        [](const auto& s, const auto& t) {
                                            return s.min_dihedral_deg < t.min_dihedral_deg;
                                        }),
                       tet);
        if (q.worst.size() > q.worst_listed) q.worst.pop_back();
    }
    q.min_dihedral_deg = q.worst.front().min_dihedral_deg;
    q.mean_edge_m = edges / (6.0 * static_cast<double>(q.tets));
    q.mean_radius_ratio = ratios / static_cast<double>(q.tets);
    return q;
}

std::string quality_table(std::span<const MeshQuality> levels) {
    std::string text = fmt::format("{:>5} {:>9} {:>9} {:>9} {:>10} {:>25} {:>15} {:>13}\n", "level",
                                   "tets", "nodes", "surface", "volume/ml", "edge min/mean/max/mm",
                                   "dihedral/deg", "3r/R min/mean");
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const MeshQuality& q = levels[l];
        text += fmt::format(
            "{:>5} {:>9} {:>9} {:>9} {:>10.4g} {:>7.3g} / {:>6.3g} / {:>6.3g} {:>6.1f} / {:>6.1f} "
            "{:>5.3f} / {:>5.3f}\n",
            l, q.tets, q.nodes, q.boundary_triangles, 1e6 * q.volume_m3, 1e3 * q.min_edge_m,
            1e3 * q.mean_edge_m, 1e3 * q.max_edge_m, q.min_dihedral_deg, q.max_dihedral_deg,
            q.min_radius_ratio, q.mean_radius_ratio);
    }
    return text;
}

std::string dihedral_histogram(const MeshQuality& q) {
    const double all = 6.0 * static_cast<double>(q.tets);
    constexpr double stars_for_all = 250;
    std::string text;
    for (std::size_t bin = 0; bin < q.dihedral_counts.size(); ++bin) {
        const auto count = static_cast<double>(q.dihedral_counts[bin]);
        text += fmt::format(
            "{:>3} to {:>3} deg {:>9} {:>7.3f} % {}\n", 10 * bin, 10 * (bin + 1),
            q.dihedral_counts[bin], 100 * count / all,
            std::string(static_cast<std::size_t>(std::lround(stars_for_all * count / all)), '*'));
    }
    for (const MeshQuality::WorstTet& tet : q.worst)
        text += fmt::format("worst: tet {}, {:.2f} deg, 3r/R {:.3f}, at {}\n", tet.tet,
                            tet.min_dihedral_deg, tet.radius_ratio, place_mm(tet.place));
    return text;
}

}  // namespace livetet
