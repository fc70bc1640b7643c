#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A place fixed in a body, as a mean of nodal values: v = sum_k weights[k] v[nodes[k]].
struct BodyPlace {
    std::vector<std::int32_t> nodes;
    std::vector<double> weights;

    Vector3 of(std::span<const Vector3> values) const;
    /// The same of each column of a field: three rows a node, any number of columns.
    Eigen::MatrixXd rows_of(const Eigen::MatrixXd& fields) const;
};

/// The places of points (at rest, m) in a mesh of four- or ten-node tets; a point outside takes the
/// nearest place of the boundary. Throws Error as `map_into` does.
std::vector<BodyPlace> places_in(const TetMesh& mesh, std::span<const Vector3> points);

/// A place of the body that was found, measured where it is now.
struct Landmark {
    BodyPlace place;
    Vector3 measured = Vector3::Zero();  ///< m, in the frame of the surface points
};

}  // namespace livetet
