#include "solvers/inverse/adjoint_gradient.hpp"

namespace livetet {

Eigen::VectorXd adjoint_gradient(DeformableBody& body, const ForceBasis& basis,
                                 std::span<const Vector3> by_displacement,
                                 double relative_tolerance) {
    std::vector<Vector3> lambda;
    const LinearReport report = body.response(by_displacement, relative_tolerance, lambda);
    if (!report.converged)
        fail("adjoint gradient: the linear solve ended with {} after {} iterations", report.reason,
             report.iterations);
    return basis.project(lambda);
}

}  // namespace livetet
