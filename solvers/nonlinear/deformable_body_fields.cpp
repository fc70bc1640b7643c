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
    const double points = !share.hexahedra.empty() ? 8 : share.edge_nodes.empty() ? 1 : 4;
    fine.visit_stress(configuration(), [&](std::size_t e, int, const Eigen::Matrix3d& stress) {
        local[e].cauchy_stress_Pa += stress / points;
    });
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
    if (!share.hexahedra.empty())
        for (std::size_t e = 0; e < solver_->tet_count(); ++e)
            std::copy_n(packed.data() + numbers * (e - e % tets_per_hexahedron), numbers,
                        packed.data() + numbers * e);
    std::vector<TetFields> fields;
    fields.reserve(packed.size() / numbers);
    for (const double* at = packed.data(); at < packed.data() + packed.size(); at += numbers)
        fields.push_back({Eigen::Map<const Eigen::Matrix3d>(at), at[9], at[10]});
    return fields;
}

std::vector<Eigen::Matrix3d> DeformableBody::nodal_stress() {
    const LevelAssembler& fine = level();
    const PartitionedMesh& share = mesh();
    const bool quadratic = !share.edge_nodes.empty();
    if (!share.hexahedra.empty())
        fail("nodal_stress: found hexahedra, expected tetrahedra; tet_fields has their stress");
    // The linear function through the values v_q at the four points has at corner i the value
    // own * v_i + other * (sum of the other three).
    const double own = quadratic ? (3 * std::sqrt(5.0) + 1) / 4 : 1,
                 other = quadratic ? (1 - std::sqrt(5.0)) / 4 : 1;
    std::vector<std::array<Eigen::Matrix3d, 4>> corners(share.tets.size());
    for (auto& tet : corners) tet.fill(Eigen::Matrix3d::Zero());
    fine.visit_stress(configuration(),
                      [&](std::size_t e, int point, const Eigen::Matrix3d& stress) {
                          for (int i = 0; i < 4; ++i)
                              corners[e][i] += (i == point ? own : other) * stress;
                      });
    constexpr int numbers = 10;
    std::vector<double> packed(numbers * static_cast<std::size_t>(share.owned), 0.0);
    const auto add = [&](std::int32_t n, double volume, const Eigen::Matrix3d& stress) {
        if (n >= share.owned) return;
        double* at = packed.data() + numbers * n;
        Eigen::Map<Eigen::Matrix3d>{at} += volume * stress;
        at[9] += volume;
    };
    for (std::size_t e = 0; e < corners.size(); ++e) {
        const double volume = fine.element(e).volume;
        for (int i = 0; i < 4; ++i) add(share.tets[e][i], volume, corners[e][i]);
        for (int k = 0; quadratic && k < 6; ++k)
            add(share.edge_nodes[e][k], volume,
                (corners[e][tet_edges[k][0]] + corners[e][tet_edges[k][1]]) / 2);
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
