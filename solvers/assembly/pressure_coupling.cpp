#include "solvers/assembly/pressure_coupling.hpp"

#include <petscmat.h>

#include <bit>
#include <cmath>

#include "solvers/assembly/level_assembler_points.hpp"

namespace livetet {

namespace {

PetscHandle<Mat> make_matrix(MPI_Comm comm, PetscInt rows, PetscInt columns,
                             std::vector<PetscInt>& i, std::vector<PetscInt>& j) {
    PetscHandle<Mat> A;
    LIVETET_PETSC(MatCreate(comm, A.out()));
    LIVETET_PETSC(MatSetSizes(A.get(), rows, columns, PETSC_DETERMINE, PETSC_DETERMINE));
    LIVETET_PETSC(MatSetType(A.get(), MATAIJ));
    LIVETET_PETSC(
        MatSetPreallocationCOO(A.get(), static_cast<PetscCount>(i.size()), i.data(), j.data()));
    return A;
}

/// Dohrmann and Bochev's term of C, for P1 (see the class).
Eigen::Matrix4d stabilisation(const TetElement& t, const Eigen::Matrix4d& mass, int nodes) {
    if (nodes != 4) return Eigen::Matrix4d::Zero();
    return (mass - Eigen::Matrix4d::Constant(t.volume / 16)) / (2 * t.mu);
}

}  // namespace

PressureCoupling::PressureCoupling(const LevelAssembler& level) : level_(level) {
    const PressureSpace& space = *level.pressure_space();
    const PartitionedMesh& share = level.share();
    // Mean stiffness of a displacement, N/m, and mean compliance of a pressure, m^3/Pa.
    double sums[4] = {0, 0, 0, 0};
    for (std::size_t t = 0; t < share.tets.size(); ++t) {
        const TetElement e = level.element(t);
        sums[0] += 2 * e.mu * e.volume * e.gradients.squaredNorm();
        sums[1] += e.volume / (2 * e.mu);
    }
    sums[2] = share.owned;
    sums[3] = space.owned;
    MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, share.comm);
    scale_ = std::sqrt(sums[0] / sums[2] / (sums[1] / sums[3]));
    if (level.single()) {
        free_ = std::make_unique<MatrixFreeCoupling>(level, scale_);
        values_.resize(space.owned);
    } else {
        make_b();
    }
    const int n = share.nodes_per_tet();
    fill(minus_c_, [&](std::size_t, const TetElement& t, const Eigen::Matrix4d& mass) {
        return Eigen::Matrix4d(-(mass / t.lambda + stabilisation(t, mass, n)));
    });
    set_constrained();
}

void PressureCoupling::make_b() {
    const PressureSpace& space = *level_.pressure_space();
    const PartitionedMesh& share = level_.share();
    const int n = share.nodes_per_tet();
    std::vector<PetscInt> rows, columns;
    for (std::size_t e = 0; e < share.tets.size(); ++e)
        for (const std::int32_t q : space.tets[e])
            for (int i = 0; i < n; ++i)
                for (PetscInt c = 0; c < 3; ++c) {
                    rows.push_back(q < space.owned ? space.numbers[q] : -1);
                    columns.push_back(3 * share.numbers[share.node(e, i)] + c);
                }
    values_.resize(rows.size());
    b_ = make_matrix(share.comm, space.owned, 3 * share.owned, rows, columns);
}

template <class Value>
void PressureCoupling::fill(PetscHandle<Mat>& matrix, Value&& value) const {
    const PressureSpace& space = *level_.pressure_space();
    const bool is_grid = !level_.share().hexahedra.empty();
    std::vector<PetscInt> rows, columns;
    std::vector<PetscScalar> values;
    for (std::size_t e = 0; e < space.tets.size(); ++e) {
        const TetElement t = level_.element(e);
        const auto add = [&](int i, int j, double of_pair) {
            const std::int32_t row = space.tets[e][i];
            rows.push_back(row < space.owned ? space.numbers[row] : -1);
            columns.push_back(space.numbers[space.tets[e][j]]);
            values.push_back(scale_ * scale_ * of_pair);
        };
        const Eigen::Matrix4d of_pairs = value(e, t, level_.pressure_mass(e));
        if (is_grid) {
            add(0, 0, of_pairs.sum());
            continue;
        }
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) add(i, j, of_pairs(i, j));
    }
    if (!matrix) matrix = make_matrix(space.comm, space.owned, space.owned, rows, columns);
    LIVETET_PETSC(MatSetValuesCOO(matrix.get(), values.data(), INSERT_VALUES));
}

double PressureCoupling::free_share(std::size_t e) const {
    const PartitionedMesh& share = level_.share();
    const int n = share.nodes_per_tet();
    int free = 0;
    for (int i = 0; i < n; ++i) free += 3 - std::popcount(level_.constrained()[share.node(e, i)]);
    return free / (3.0 * n);
}

void PressureCoupling::set_constrained() {
    const int n = level_.share().nodes_per_tet();
    fill(minus_schur_, [&](std::size_t e, const TetElement& t, const Eigen::Matrix4d& mass) {
        const double f = free_share(e);
        return Eigen::Matrix4d(
            -(mass * (1 / t.lambda + f / (2 * t.mu)) + (1 - f) * stabilisation(t, mass, n)));
    });
}

void PressureCoupling::assemble(const Configuration& at) {
    if (free_) {
        free_->take(at);
        return;
    }
    const PartitionedMesh& share = level_.share();
    const auto constrained = level_.constrained();
    std::fill(values_.begin(), values_.end(), 0.0);
    level_.visit_volume_strain(at, [&](std::size_t e, const Eigen::Vector4d& L, double weight,
                                       double, const auto& derivative) {
        const auto nodes = derivative.cols();
        PetscScalar* value = values_.data() + e * 12 * nodes;
        for (int q = 0; q < 4; ++q)
            for (int i = 0; i < nodes; ++i) {
                const std::uint8_t held = constrained[share.node(e, i)];
                for (int c = 0; c < 3; ++c, ++value)
                    if (!(held >> c & 1)) *value += scale_ * weight * L[q] * derivative(c, i);
            }
    });
    LIVETET_PETSC(MatSetValuesCOO(b_.get(), values_.data(), INSERT_VALUES));
}

void PressureCoupling::multiply_c(Vec p, Vec g) {
    LIVETET_PETSC(MatMult(minus_c_.get(), p, g));  // - scale^2 C p
    LIVETET_PETSC(VecScale(g, 1 / scale_));
}

void PressureCoupling::pressures_of(Vec g, Vec p) const {
    LIVETET_PETSC(MatGetDiagonal(minus_c_.get(), p));  // all of it: - scale^2 C
    LIVETET_PETSC(VecPointwiseDivide(p, g, p));
    LIVETET_PETSC(VecScale(p, -scale_));
}

void PressureCoupling::evaluate(const Configuration& at, Vec f, Vec g) {
    if (!free_) {
        level_.elastic_force(at, f);
        residual(at, g);
        return;
    }
    multiply_c(at.p, g);
    free_->take(at);
    WriteArray forces(f), values(g);
    free_->evaluate(forces.span(), values_);
    for (std::size_t i = 0; i < values_.size(); ++i) values[i] += values_[i];
}

void PressureCoupling::add_increments(const Configuration& at, double factor, Vec v, Vec f, Vec g) {
    if (!free_) {
        LIVETET_PETSC(VecSet(f, 0));
        level_.add_stiffness_times(factor, at, v, f);
        add_residual_increment(at, v, g);
        return;
    }
    free_->take(at);
    const ReadArray of(v);
    WriteArray forces(f), values(g);
    free_->multiply(factor, of.span(), {}, forces.span(), values_, Support::constrained);
    for (std::size_t i = 0; i < values_.size(); ++i) values[i] += values_[i];
}

void PressureCoupling::residual(const Configuration& at, Vec g) {
    multiply_c(at.p, g);
    const PressureSpace& space = *level_.pressure_space();
    WriteArray values(g);
    level_.visit_volume_strain(
        at, [&](std::size_t e, const Eigen::Vector4d& L, double weight, double theta, const auto&) {
            for (int q = 0; q < 4; ++q)
                if (const std::int32_t row = space.tets[e][q]; row < space.owned)
                    values[row] += scale_ * weight * L[q] * theta;
        });
}

void PressureCoupling::add_residual_increment(const Configuration& at, Vec v, Vec g) {
    const PressureSpace& space = *level_.pressure_space();
    const PartitionedMesh& share = level_.share();
    const LocalValues direction(v);
    WriteArray values(g);
    level_.visit_volume_strain(at, [&](std::size_t e, const Eigen::Vector4d& L, double weight,
                                       double, const auto& derivative) {
        double increment = 0;
        for (int i = 0; i < derivative.cols(); ++i)
            increment += derivative.col(i).dot(
                Eigen::Map<const Eigen::Vector3d>(direction.data() + 3 * share.node(e, i)));
        for (int q = 0; q < 4; ++q)
            if (const std::int32_t row = space.tets[e][q]; row < space.owned)
                values[row] += scale_ * weight * L[q] * increment;
    });
}

}  // namespace livetet
