// A material of one's own: a soft tissue that stiffens exponentially (Demiray 1972).
//
//     psi = mu / (2 b) (exp(b q) - 1) + mu / 2 (J - 1)^2 + lambda / 2 (J - 1)^2,
//     q = |F|^2 - 3 - 2 (J - 1),    P = dpsi / dF,    J = det F
//
// A class gives the energy without its lambda part and its derivatives; one call registers it, and
// then scenes may name it too ("model: demiray"). A block is sheared by F = I + gamma e_x e_y^T:
// J = 1 and P_xy = mu gamma exp(b gamma^2). Sample run:  custom_material
#include <fmt/format.h>

#include "livetet/mechanics/materials/kinematics.hpp"
#include "livetet/mechanics/materials/registry.hpp"
#include "livetet/mesh/shapes.hpp"
#include "livetet/solvers/nonlinear/deformable_body.hpp"
#include "livetet/solvers/parallel/petsc_session.hpp"
using namespace livetet;

// 1. The material. H = F - I; the rotation R is for corotated models.
class Demiray : public ConstitutiveModel {
  public:
    double b = 3;  ///< how fast it stiffens

    Names names() const override { return {"demiray", "Demiray", "tissue that stiffens"}; }
    std::unique_ptr<ConstitutiveModel> clone() const override {
        return std::make_unique<Demiray>(*this);
    }
    void visit_keys(FieldVisitor& v) override {
        v.field("b", b, "", "exponent of the stiffening",
                {"greater than 0", [](const double& x) { return x > 0; }});
    }
    double shear_energy(double mu, const Matrix3& H, const Matrix3&) const override {
        const double J1 = dilation_of(H);
        return mu / (2 * b) * std::expm1(b * q(H)) + mu / 2 * J1 * J1;
    }
    Matrix3 shear_stress(double mu, const Matrix3& H, const Matrix3&) const override {
        const Matrix3 F = deformation_gradient(H), N = cofactor_of(F);
        return mu * (std::exp(b * q(H)) * (F - N) + dilation_of(H) * N);
    }
    Matrix3 shear_stress_increment(double mu, double p, const Matrix3& H, const Matrix3&,
                                   const Matrix3& dF) const override {
        const Matrix3 F = deformation_gradient(H), N = cofactor_of(F);
        const Matrix3 dN = cofactor_increment(F, dF), Q = F - N;  // 2 Q = dq / dF
        return mu * std::exp(b * q(H)) * (dF - dN + 2 * b * Q.cwiseProduct(dF).sum() * Q) +
               mu * N.cwiseProduct(dF).sum() * N + (mu * dilation_of(H) + p) * dN;
    }

  private:
    static double q(const Matrix3& H) {  // 2 tr H - 2 (J - 1) cancels in the first order
        return H.squaredNorm() + 2 * H.trace() - 2 * dilation_of(H);
    }
};

int main(int argc, char** argv) try {
    const PetscSession session(argv[0], {argv + 1, argv + argc});
    register_material(std::make_unique<Demiray>());
    // 2. A block of 100 mm whose surface is sheared by gamma.
    const double gamma = 0.4, side = 0.1;  // m
    const MeshHierarchy hierarchy =
        make_hierarchy({shapes::box({side, side, side}, {4, 4, 4})}, "");
    const TetMesh& mesh = hierarchy.levels.front();
    const Material tissue{.young_Pa = 3000, .poisson = 0.45};
    Constraints constraints(mesh.nodes.size());
    for (const std::int32_t n : nodes_of(boundary_triangles(mesh.tets)))
        constraints.prescribe({&n, 1}, {gamma * mesh.nodes[n].y(), 0, 0});
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {{&tissue, 1}, "demiray"}, {},
                        {.kind = SolverKind::direct});
    body.set_constraints(constraints);
    if (!body.solve(0, {.tolerance = 1e-10}).converged) return 1;
    double force = 0;  // 3. N, that holds the top: P_xy over its area (the sides have P_xx = 0)
    const auto reactions = body.reactions();
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (mesh.nodes[n].y() > side - 1e-9) force += reactions[n].x();
    const double stress = force / (side * side), mu = tissue.mu();
    const double exact = mu * gamma * std::exp(3 * gamma * gamma);  // Pa
    fmt::print("shear stress {:.3f} Pa, closed form {:.3f} Pa\n", stress, exact);
    return std::abs(stress - exact) < 1e-6 * exact ? 0 : 1;
} catch (const std::exception& error) {
    fmt::print(stderr, "custom_material: {}\n", error.what());
    return 2;
}
