#include "mesh/turned_elements.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "mesh/mesh_pieces.hpp"

namespace livetet {

namespace {

/// The sum over a cell's corners by the sides that they are on is four times its mean edges.
bool is_turned(const Hexahedron& cell, std::span<const Vector3> rest,
               std::span<const Vector3> displacement) {
    Eigen::Matrix3d edges = Eigen::Matrix3d::Zero();
    for (int c = 0; c < 8; ++c) {
        const Vector3 x = rest[cell[c]] + displacement[cell[c]];
        for (int d = 0; d < 3; ++d) edges.col(d) += c >> d & 1 ? x : Vector3(-x);
    }
    return !(edges.determinant() > 0);
}

bool is_turned(const Tet& tet, std::span<const Vector3> rest,
               std::span<const Vector3> displacement) {
    Eigen::Matrix3d edges;
    const Vector3 first = rest[tet[0]] + displacement[tet[0]];
    for (int k = 0; k < 3; ++k) edges.col(k) = rest[tet[k + 1]] + displacement[tet[k + 1]] - first;
    return !(edges.determinant() > 0);
}

}  // namespace

TurnedElements::TurnedElements(const TetMesh& mesh)
    : of_turn_((cell_count(mesh) + per_look - 1) / per_look, 0) {}

void TurnedElements::look(const TetMesh& mesh, std::span<const Vector3> displacement) {
    const std::size_t begin = turn_ * per_look, end = std::min(begin + per_look, cell_count(mesh));
    std::size_t found = 0;
    if (mesh.hexahedra.empty())
        for (std::size_t e = begin; e < end; ++e)
            found += is_turned(mesh.tets[e], mesh.nodes, displacement);
    else
        for (std::size_t e = begin; e < end; ++e)
            found +=
                mesh.shares[e] >= 0.5 && is_turned(mesh.hexahedra[e], mesh.nodes, displacement);
    count_ += found - of_turn_[turn_];
    of_turn_[turn_] = found;
    turn_ = (turn_ + 1) % of_turn_.size();
}

}  // namespace livetet
