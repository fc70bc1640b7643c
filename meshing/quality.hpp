#pragma once

#include <array>
#include <span>
#include <string>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Size and shape of a tet mesh. Lengths in metres, angles in degrees.
struct MeshQuality {
    std::int64_t nodes = 0, tets = 0, boundary_triangles = 0;
    double volume_m3 = 0;
    double min_edge_m = 0, mean_edge_m = 0, max_edge_m = 0;
    double min_dihedral_deg = 0, max_dihedral_deg = 0;
    double min_radius_ratio = 0, mean_radius_ratio = 0;  ///< 3 r_in / r_circ: 1 regular, 0 flat
    /// Histogram of all six angles of each tet in steps of 10 degrees.
    std::array<std::int64_t, 18> dihedral_counts{};
    /// The tets with the smallest dihedral angles, worst first; at most `worst_listed`.
    struct WorstTet {
        std::int64_t tet = -1;
        double min_dihedral_deg = 180, radius_ratio = 1;
        Vector3 place = Vector3::Zero();  ///< its centre, metres
    };
    std::vector<WorstTet> worst;
    static constexpr std::size_t worst_listed = 5;
};

/// Radius ratio 3 r_in / r_circ of a tet: 1 for a regular tet, 0 for a flat one.
///
///     r_in = 3 V / A,   r_circ = sqrt((p + q + r)(p + q - r)(p - q + r)(-p + q + r)) / (24 V)
///
/// with p, q, r the products of the lengths of opposite edges.
double radius_ratio(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// The dihedral angles at the six edges, in degrees.
std::array<double, 6> dihedral_angles_deg(const Vector3& a, const Vector3& b, const Vector3& c,
                                          const Vector3& d);

/// Measures a mesh. Precondition: it passes `check_tet_mesh`.
MeshQuality measure_quality(const TetMesh& mesh);

/// A table with one row for each level, in mm, ml and degrees. Every line ends with a line break.
std::string quality_table(std::span<const MeshQuality> levels);

/// Text histogram of the dihedral angles in steps of ten degrees, followed by the worst tets with
/// their positions.
std::string dihedral_histogram(const MeshQuality& quality);

}  // namespace livetet
