#include "solvers/inverse/force_basis.hpp"

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "geometry/spread_points.hpp"

namespace livetet {

void ForceBasis::add_pattern(std::span<const std::int32_t> nodes, std::span<const double> shares) {
    const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
    if (nodes.size() != shares.size() || !(sum > 0))
        fail("force basis: found {} nodes and {} shares of sum {}, expected as many and a sum > 0",
             nodes.size(), shares.size(), sum);
    for (int axis = 0; axis < 3; ++axis) {
        Column& column = columns_.emplace_back();
        column.axis = axis;
        column.nodes.assign(nodes.begin(), nodes.end());
        for (const double s : shares) column.shares.push_back(s / sum);
    }
}

void ForceBasis::add(const ForceBasis& other) {
    const int zones = zone_count();
    for (Column column : other.columns_) {
        column.zone += zones;
        columns_.push_back(std::move(column));
    }
}

std::vector<Vector3> ForceBasis::force(const Eigen::VectorXd& p, std::size_t nodes) const {
    std::vector<Vector3> f(nodes, Vector3::Zero());
    for (std::size_t j = 0; j < columns_.size(); ++j) {
        const Column& c = columns_[j];
        for (std::size_t k = 0; k < c.nodes.size(); ++k)
            f[c.nodes[k]][c.axis] += c.shares[k] * p[static_cast<Eigen::Index>(j)];
    }
    return f;
}

Eigen::MatrixXd ForceBasis::matrix(std::size_t nodes) const {
    const auto count = static_cast<Eigen::Index>(size());
    Eigen::MatrixXd b = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(nodes), count);
    for (Eigen::Index j = 0; j < count; ++j) {
        const Column& c = columns_[static_cast<std::size_t>(j)];
        for (std::size_t k = 0; k < c.nodes.size(); ++k)
            b(3 * c.nodes[k] + c.axis, j) += c.shares[k];
    }
    return b;
}

Eigen::MatrixXd ForceBasis::project(const Eigen::MatrixXd& fields) const {
    const auto count = static_cast<Eigen::Index>(size());
    Eigen::MatrixXd projected = Eigen::MatrixXd::Zero(count, fields.cols());
    for (Eigen::Index j = 0; j < count; ++j) {
        const Column& c = columns_[static_cast<std::size_t>(j)];
        for (std::size_t k = 0; k < c.nodes.size(); ++k)
            projected.row(j) += c.shares[k] * fields.row(3 * c.nodes[k] + c.axis);
    }
    return projected;
}

Vector3 ForceBasis::total(const Eigen::VectorXd& p) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t j = 0; j < columns_.size(); ++j)
        sum[columns_[j].axis] += p[static_cast<Eigen::Index>(j)];
    return sum;
}

Eigen::MatrixXd ForceBasis::of_whole_zones() const {
    const int zones = zone_count();
    Eigen::MatrixXd z = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(size()), 3 * zones);
    for (std::size_t j = 0; j < columns_.size(); ++j)
        z(static_cast<Eigen::Index>(j), 3 * columns_[j].zone + columns_[j].axis) = 1;
    return z;
}

ForceBasis uniform_forces(std::span<const std::int32_t> nodes) {
    ForceBasis basis;
    basis.add_pattern(nodes, std::vector<double>(nodes.size(), 1.0));
    return basis;
}

ForceBasis smooth_forces(std::span<const Vector3> rest, std::span<const std::int32_t> nodes,
                         std::size_t centres) {
    if (centres == 0 || nodes.size() < centres)
        fail("smooth forces: found {} nodes and {} centres, expected 1 to {} centres", nodes.size(),
             centres, nodes.size());
    std::vector<Vector3> places;
    for (const std::int32_t n : nodes) places.push_back(rest[n]);
    const SpreadPoints spread = spread_points(places, centres);
    // A centre at every node: each has itself alone.
    const double radius = std::max(1.5 * spread.radius, 1e-9);
    ForceBasis basis;
    for (const std::size_t centre : spread.chosen) {
        std::vector<std::int32_t> near;
        std::vector<double> shares;
        for (const std::int32_t n : nodes) {
            const double r = (rest[n] - places[centre]).norm() / radius;
            if (r >= 1) continue;
            near.push_back(n);
            shares.push_back((1 - r) * (1 - r) * (1 - r) * (1 + 3 * r));
        }
        basis.add_pattern(near, shares);
    }
    return basis;
}

}  // namespace livetet
