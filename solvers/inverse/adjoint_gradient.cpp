#include "solvers/inverse/adjoint_gradient.hpp"

namespace livetet {

Eigen::VectorXd adjoint_gradient(DeformableBody& body, const ForceBasis& basis,
                                 std::span<const Vector3> by_displacement,
                                 double relative_tolerance) {
    const Eigen::Map<const Eigen::VectorXd> load(by_displacement.front().data(),
                                                 3 * std::ssize(by_displacement));
    Eigen::MatrixXd adjoint;
    const LinearReport report = body.responses(load, relative_tolerance, adjoint);
    if (!report.converged)
        fail("adjoint gradient: the linear solve ended with {} after {} iterations", report.reason,
             report.iterations);
    return basis.project(adjoint);
}

}  // namespace livetet
