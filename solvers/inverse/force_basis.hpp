#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// Patterns of nodal forces, the columns of a matrix B: f = B p, with p in N. Each column is a
/// share of 1 N at each of its nodes, along one axis: its shares sum to 1, so that the total force
/// is the sum of the coefficients of each axis.
class ForceBasis {
  public:
    struct Column {
        int axis = 0;
        int zone = 0;  ///< columns of one zone may move as a whole, see `of_whole_zones`
        std::vector<std::int32_t> nodes;
        std::vector<double> shares;
    };

    std::size_t size() const { return columns_.size(); }
    const Column& column(std::size_t j) const { return columns_[j]; }
    /// One column for each axis, in the first zone. Throws Error unless the shares have a positive
    /// sum.
    void add_pattern(std::span<const std::int32_t> nodes, std::span<const double> shares);
    /// Appends the columns of another basis of the same body. Its zones are others than those here.
    void add(const ForceBasis& other);

    /// f = B p for a body of so many nodes, N.
    std::vector<Vector3> force(const Eigen::VectorXd& p, std::size_t nodes) const;
    /// B for a body of so many nodes: three rows a node.
    Eigen::MatrixXd matrix(std::size_t nodes) const;
    /// B^T X for fields of the body's nodes: one a column, three rows a node.
    Eigen::MatrixXd project(const Eigen::MatrixXd& fields) const;
    /// Sum of the nodal forces, N.
    Vector3 total(const Eigen::VectorXd& p) const;
    /// Z, size x 3 zones: p = Z z is the same force on each pattern of a zone, 1 N each, so that
    /// each zone is pulled or pushed as a whole.
    Eigen::MatrixXd of_whole_zones() const;

  private:
    int zone_count() const { return columns_.empty() ? 0 : columns_.back().zone + 1; }

    std::vector<Column> columns_;
};

/// The same force at each of these nodes: three columns. For a stated zone that is pulled or
/// pushed as a whole.
ForceBasis uniform_forces(std::span<const std::int32_t> nodes);

/// Smooth forces on these nodes, about `centres` of them that are as far from each other as can be
/// (farthest-point sampling, Gonzalez 1985): 3 `centres` columns of Wendland's function (1 - r)^3
/// (1 + 3 r), r = distance at rest / radius, the radius being 1.5 times the largest distance of a
/// node from its centre. For forces whose place is not known. Throws Error unless there are as many
/// nodes as centres.
ForceBasis smooth_forces(std::span<const Vector3> rest, std::span<const std::int32_t> nodes,
                         std::size_t centres);

}  // namespace livetet
