#pragma once

#include <algorithm>

#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet::test {

/// Fills `v` from values of the whole mesh's nodes, and gathers them on every rank.
inline void fill(const PartitionedMesh& share, std::span<const Vector3> whole, Vec v) {
    set_values(share, local_part(share, whole), v);
}
inline std::vector<Vector3> gather(const PartitionedMesh& share, Vec v) {
    return whole_values(share, local_values(share, v));
}

/// A body whose arrays are of the whole mesh's nodes, on every rank.
class WholeBody : public DeformableBody {
  public:
    using DeformableBody::DeformableBody;

    void set_constraints(const Constraints& whole) {
        Constraints local(0);
        local.components = part<std::uint8_t>(whole.components);
        local.values = part<Vector3>(whole.values);
        DeformableBody::set_constraints(local);
    }
    void move_constraints(std::span<const std::int32_t> nodes, std::span<const Vector3> values) {
        std::vector<std::int32_t> local;
        std::vector<Vector3> moved;
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const auto at = std::ranges::find(share().nodes, nodes[k]);
            if (at == share().nodes.end()) continue;
            local.push_back(static_cast<std::int32_t>(at - share().nodes.begin()));
            moved.push_back(values[k]);
        }
        DeformableBody::move_constraints(local, moved);
    }
    void set_springs(const Springs& whole) {
        DeformableBody::set_springs({part<double>(whole.stiffness), part<Vector3>(whole.target)});
    }
    void set_external_force(std::span<const Vector3> whole, double factor = 1) {
        DeformableBody::set_external_force(part<Vector3>(whole), factor);
    }
    void set_displacement(std::span<const Vector3> whole) {
        DeformableBody::set_displacement(part<Vector3>(whole));
    }
    void set_velocity(std::span<const Vector3> whole) {
        DeformableBody::set_velocity(part<Vector3>(whole));
    }
    std::vector<Vector3> displacement() const { return whole_of(DeformableBody::displacement()); }
    std::vector<Vector3> velocity() const { return whole_of(DeformableBody::velocity()); }
    std::vector<Vector3> reactions() { return whole_of(DeformableBody::reactions()); }
    std::vector<Vector3> elastic_force() { return whole_of(DeformableBody::elastic_force()); }
    std::vector<Eigen::Matrix3d> nodal_stress() {
        const std::vector<Eigen::Matrix3d> local = DeformableBody::nodal_stress();
        std::vector<Eigen::Matrix3d> stress(share().total);
        for (int c = 0; c < 3; ++c) {
            std::vector<Vector3> column;
            for (const Eigen::Matrix3d& s : local) column.emplace_back(s.col(c));
            column = whole_of(column);
            for (std::size_t n = 0; n < stress.size(); ++n) stress[n].col(c) = column[n];
        }
        return stress;
    }

  private:
    const PartitionedMesh& share() const { return linear_solver().fine().share(); }
    template <class T>
    std::vector<T> part(std::span<const T> whole) const {
        return whole.empty() ? std::vector<T>{} : local_part(share(), whole);
    }
    std::vector<Vector3> whole_of(const std::vector<Vector3>& local) const {
        return whole_values(share(), local);
    }
};

}  // namespace livetet::test
