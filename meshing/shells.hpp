#pragma once

#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A connected piece of a body: what its outer surface encloses, without its cavities.
struct BodyPiece {
    TriangleMesh outer;                  ///< wound outwards
    std::vector<TriangleMesh> cavities;  ///< wound into the cavities: of negative signed volume

    double volume_m3() const;
};

/// The pieces that closed, consistently wound surfaces bound, the largest first; cavities likewise.
/// A cavity belongs to the smallest outer surface around it; one without any is dropped.
std::vector<BodyPiece> pieces_of(const TriangleMesh& surface);

/// The same as triangles with the nodes of the whole surface: for each piece its outer shell, then
/// its cavities.
std::vector<std::vector<std::vector<Triangle>>> shells_by_piece(const TriangleMesh& surface);

/// Surfaces as one.
TriangleMesh joined(std::span<const TriangleMesh> surfaces);
TriangleMesh joined(std::span<const BodyPiece> pieces);

/// Number of times that a closed surface winds around a position: 1 inside, 0 outside. The sum of
/// the triangles' solid angles (A. van Oosterom, J. Strackee, 1983), O(triangles).
double winding_number(std::span<const Vector3> nodes, std::span<const Triangle> triangles,
                      const Vector3& position);

/// Number of a body's pieces and of their cavities.
struct ShellCount {
    std::size_t pieces = 0, cavities = 0;
    bool operator==(const ShellCount&) const = default;
};
ShellCount count_shells(std::span<const BodyPiece> pieces);

/// The largest shells of a surface: as many outer ones as `count` has pieces, and as many cavities.
TriangleMesh largest_shells(const TriangleMesh& surface, const ShellCount& count);

/// Moves the nodes of a closed shell along their normals by the same small distance, so that its
/// signed volume becomes `volume_m3`.
void shift_to_volume(TriangleMesh& shell, double volume_m3);

/// Names the boundary's shells. With cavities: the triangle and node sets `cavity` (all of them),
/// `cavity_1`, `cavity_2` ... if there are several, and `outer` for the rest of the boundary. With
/// several pieces: the node sets `part_1`, `part_2` ... of all their nodes. The largest come first.
/// For meshes of four-node tets.
void name_shells(TetMesh& mesh);

}  // namespace livetet
