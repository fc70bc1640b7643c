// Results of a body in its present state: stresses, volume ratios, energies.

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>

#include "mechanics/stress.hpp"
#include "solvers/assembly/level_assembler_points.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

Configuration DeformableBody::configuration() {
    balance_.update_rotations();
    return balance_.configuration();
}

std::vector<TetFields> DeformableBody::local_tet_fields() {
    const LevelAssembler& fine = level();
    const PartitionedMesh& share = mesh();
    std::vector<TetFields> local(share.tets.size());
    fine.visit_fields(configuration(),
                      [&](std::size_t e, const TetFields& fields) { local[e] = fields; });
    std::vector<double> volumes(local.size(), 0.0);
    fine.visit_stress(configuration(),
                      [&](std::size_t e, int, double weight, const Eigen::Matrix3d& stress) {
                          local[e].cauchy_stress_Pa += weight * stress;
                          volumes[e] += weight;
                      });
    for (std::size_t e = 0; e < local.size(); ++e) local[e].cauchy_stress_Pa /= volumes[e];
    return local;
}

double DeformableBody::largest_von_mises() {
    double largest = 0;
    for (const TetFields& f : local_tet_fields())
        largest = std::max(largest, von_mises(f.cauchy_stress_Pa));
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, mesh().comm);
    return largest;
}

std::size_t DeformableBody::inverted_tets() {
    const PartitionedMesh& share = mesh();
    std::uint64_t count = 0;
    level().visit_volume_ratio(configuration(), [&](std::size_t e, double ratio) {
        // Each tet is counted by the rank that owns its first corner.
        count += share.tets[e][0] < share.owned && ratio <= 0;
    });
    MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_UINT64_T, MPI_SUM, share.comm);
    return count;
}

std::vector<TetFields> DeformableBody::tet_fields() {
    const PartitionedMesh& share = mesh();
    // Each tet from the rank that owns its first corner.
    constexpr int numbers = 11;
    std::vector<double> packed;
    std::vector<std::int32_t> mine;
    {
        const std::vector<TetFields> local = local_tet_fields();
        for (std::size_t e = 0; e < local.size(); ++e) {
            if (share.tets[e][0] >= share.owned) continue;
            mine.push_back(share.tet_ids[e]);
            const double* stress = local[e].cauchy_stress_Pa.data();
            packed.insert(packed.end(), stress, stress + 9);
            packed.push_back(local[e].volume_change);
            packed.push_back(local[e].strain_energy_J_per_m3);
        }
    }
    packed = RowBlocks(share.comm, solver_->tet_count(), mine).to_block(packed, numbers);
    // The tets of a hexahedron have its mean fields. Hexahedra are on one rank.
    if (share.has_hexahedra()) {
        const std::size_t alike = solver_->tet_count() / share.tets.size();
        for (std::size_t e = 0; e < solver_->tet_count(); ++e)
            std::copy_n(packed.data() + numbers * (e - e % alike), numbers,
                        packed.data() + numbers * e);
    }
    std::vector<TetFields> fields;
    fields.reserve(packed.size() / numbers);
    for (const double* at = packed.data(); at < packed.data() + packed.size(); at += numbers)
        fields.push_back({Eigen::Map<const Eigen::Matrix3d>(at), at[9], at[10]});
    return fields;
}

namespace {

/// Stresses at nodes of each element, from those at its quadrature points.
struct ElementStress {
    std::size_t kept;  ///< nodes of an element that values are kept of: corners, or all 27
    std::vector<Eigen::Matrix3d> values;  ///< element after element

    ElementStress(std::size_t of_each, std::size_t elements)
        : kept(of_each), values(of_each * elements, Eigen::Matrix3d::Zero()) {}
    /// At node i of element e; at the middle of a tet's edge the mean of its ends'.
    Eigen::Matrix3d at(std::size_t e, std::size_t i) const {
        if (i < kept) return values[kept * e + i];
        const auto& [a, b] = tet_edges[i - kept];
        return (values[kept * e + a] + values[kept * e + b]) / 2;
    }
};

/// Of tets: the linear function through the values v_q at the four points has at corner i the value
/// own * v_i + other * (sum of the other three).
ElementStress stress_at_tets(const LevelAssembler& level, const Configuration& at) {
    const PartitionedMesh& share = level.share();
    const bool quadratic = !share.edge_nodes.empty();
    const double own = quadratic ? (3 * std::sqrt(5.0) + 1) / 4 : 1,
                 other = quadratic ? (1 - std::sqrt(5.0)) / 4 : 1;
    ElementStress nodal(4, share.tets.size());
    level.visit_stress(at, [&](std::size_t e, int point, double, const Eigen::Matrix3d& stress) {
        for (int i = 0; i < 4; ++i) nodal.values[4 * e + i] += (i == point ? own : other) * stress;
    });
    return nodal;
}

/// Of quadratic hexahedra: the trilinear function nearest to the values at the 3 x 3 x 3 points.
/// Along an axis it has at x = 0, 1/2 and 1 the values
///     sum_a w_a (1 + 12 (x - 1/2) (x_a - 1/2)) v_a.
/// So it is what the 2 x 2 x 2 points would give, where the stress is of higher order (Barlow
/// 1976).
ElementStress stress_at_hexahedra(const LevelAssembler& level, const Configuration& at) {
    const double of_far = 5.0 / 18, slope = 12 * of_far * 0.5 * std::sqrt(0.6) / 2;
    const double from[3][3] = {{of_far + slope, 8.0 / 18, of_far - slope},
                               {of_far, 8.0 / 18, of_far},
                               {of_far - slope, 8.0 / 18, of_far + slope}};
    ElementStress nodal(27, level.share().tets.size());
    level.visit_stress(at, [&](std::size_t e, int p, double, const Eigen::Matrix3d& stress) {
        for (int i = 0; i < 27; ++i)
            nodal.values[27 * e + i] +=
                from[i % 3][p % 3] * from[i / 3 % 3][p / 3 % 3] * from[i / 9][p / 9] * stress;
    });
    return nodal;
}

}  // namespace

std::vector<Eigen::Matrix3d> DeformableBody::nodal_stress() {
    const LevelAssembler& fine = level();
    const PartitionedMesh& share = mesh();
    if (!share.hexahedra.empty())
        fail("nodal_stress: found a grid, expected tetrahedra; tet_fields has its stress");
    const ElementStress of_elements = share.quadratic_hexahedra.empty()
                                          ? stress_at_tets(fine, configuration())
                                          : stress_at_hexahedra(fine, configuration());
    constexpr int numbers = 10;  // of a node: the sum of volume times stress, and of the volume
    std::vector<double> packed(numbers * static_cast<std::size_t>(share.owned), 0.0);
    const int nodes = share.nodes_per_tet();
    for (std::size_t e = 0; e < share.tets.size(); ++e) {
        const double volume = fine.element(e).volume;
        for (int i = 0; i < nodes; ++i) {
            const std::int32_t n = share.node(e, i);
            if (n >= share.owned) continue;
            double* at = packed.data() + numbers * n;
            Eigen::Map<Eigen::Matrix3d>{at} +=
                volume * of_elements.at(e, static_cast<std::size_t>(i));
            at[9] += volume;
        }
    }
    std::vector<Eigen::Matrix3d> stress;
    for (const double* at = packed.data(); at < packed.data() + packed.size(); at += numbers)
        stress.push_back(Eigen::Map<const Eigen::Matrix3d>(at) / at[9]);
    return with_ghosts<Eigen::Matrix3d>(share, stress);
}

double DeformableBody::strain_energy() { return level().strain_energy(configuration()); }

double DeformableBody::kinetic_energy() {
    const PartitionedMesh& share = mesh();
    const auto mass = level().node_mass();
    double energy = 0;
    if (time_.is_dynamic()) {
        const ReadArray v(state_.v.get());
        for (std::size_t i = 0; i < v.span().size(); ++i) energy += 0.5 * mass[i / 3] * v[i] * v[i];
    }
    MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, share.comm);
    return energy;
}

}  // namespace livetet
