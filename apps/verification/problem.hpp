#pragma once

#include <chrono>
#include <functional>
#include <memory>

#include "apps/verification/closed_forms.hpp"
#include "apps/verification/suite.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet::verification {

/// How a case is discretised.
struct Discretisation {
    ModelChoice strain = "linear";
    bool quadratic = false;  ///< P2; the meshes are P1
    Formulation formulation = Formulation::displacement;
    bool hexahedral = false;  ///< Q2: the meshes are such
    std::string name() const;
    bool is_linear() const { return strain->kinematics() == Kinematics::small_strain; }
};

inline Material material(const Isotropic& m) {
    return {.young_Pa = m.E, .poisson = m.nu, .density_kg_per_m3 = m.rho};
}

/// A body under loads and constraints, set up a line at a time. Levels of the mesh, the finest
/// first: more than one are solved by multigrid, one by a factorisation.
class Problem {
  public:
    Problem(std::vector<TetMesh> levels, const Isotropic& m, const Discretisation& d,
            const TimeOptions& time = {}, SolverOptions solver = {});

    const TetMesh& mesh() const { return hierarchy_.levels.front(); }
    DeformableBody& body() { return *body_; }
    std::size_t node_count() const { return mesh().nodes.size(); }

    /// Prescribes components of the nodes of a set ("xyz"), or of all nodes for which `chosen`
    /// holds.
    void hold(const std::string& set, const std::string& components,
              const Vector3& value = Vector3::Zero());
    void prescribe(const std::function<bool(const Vector3& x)>& chosen,
                   const std::function<Vector3(const Vector3& x)>& value,
                   const std::string& components = "xyz");
    /// Prescribes all nodes of the surface.
    void prescribe_surface(const std::function<Vector3(const Vector3& x)>& value);
    /// Traction (Pa) at places x of a triangle set with outward normals n, dead.
    void traction(const std::string& set,
                  const std::function<Vector3(const Vector3& x, const Vector3& n)>& value);
    /// Adds a force (N) at a node.
    void force(std::int32_t node, const Vector3& value) { force_[node] += value; }
    void body_force(const std::function<Vector3(const Vector3& x)>& value);

    /// Gives constraints and forces to the body, for steps of the caller's own.
    void apply();
    /// Static equilibrium in so many load steps; throws std::runtime_error where none is found.
    void solve(int load_steps = 1, double tolerance = 1e-9);

    std::int32_t node_at(const Vector3& x) const;
    Vector3 displacement_at(const Vector3& x) const { return u_[node_at(x)]; }
    const std::vector<Vector3>& displacement() const { return u_; }
    /// L2 norm of u - exact over that of exact, by a quadrature of degree 7.
    double l2_error(const std::function<Vector3(const Vector3& x)>& exact) const;
    double seconds() const;

  private:
    MeshHierarchy hierarchy_;
    std::vector<Material> materials_;
    std::unique_ptr<DeformableBody> body_;
    Constraints constraints_;
    std::vector<Vector3> force_, u_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// "12,345 nodes".
std::string nodes_text(std::size_t nodes);

}  // namespace livetet::verification
