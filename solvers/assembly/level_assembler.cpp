#include "solvers/assembly/level_assembler.hpp"

#include <algorithm>
#include <limits>

#include "base/sliced_task.hpp"
#include "mechanics/rotation.hpp"
#include "solvers/assembly/batch_support.hpp"
#include "solvers/assembly/level_assembler_points.hpp"
#include "solvers/parallel/team_vector.hpp"

namespace livetet {

LevelAssembler::LevelAssembler(PartitionedMesh share, std::span<const Material> materials,
                               const ModelChoice& model, Formulation formulation,
                               LevelStorage storage, ThreadTeam& team)
    : share_(std::move(share)), team_(team), constrained_(share_.nodes.size(), 0) {
    find_moduli(materials, model);
    if (formulation == Formulation::mixed) {
        if (share_.hexahedra.empty() || std::holds_alternative<SinglePrecision>(storage))
            pressure_ = make_pressure_space(share_);
        else
            has_mean_dilation_ = true;
    }
    pause_point();
    if (const auto* layout = std::get_if<MatrixLayout>(&storage)) {
        if (is_batched()) make_double_batches();
        matrix_.emplace(share_, *layout);
    } else if (std::holds_alternative<SinglePrecision>(storage)) {
        make_single_batches();
    } else if (std::holds_alternative<BothPrecisions>(storage)) {
        make_double_batches();
        make_copy();
    }
}

void LevelAssembler::make_matrix(MatrixLayout layout) {
    matrix_.emplace(share_, layout);
    matrix_->set_constrained(constrained_);
    if (!keeps_damping_rotations_) return;
    const PetscHandle<Vec> anywhere = make_vector();  // K_d depends on rotations alone
    keep_damping({.u = anywhere.get(), .rotations = &damping_rotations_});
}

PetscHandle<Vec> LevelAssembler::make_vector() const {
    PetscHandle<Vec> v = livetet::make_vector(share_);
    if (single() && share_.ranks == 1) run_on_team(v.get(), team_);
    return v;
}

PetscHandle<Vec> LevelAssembler::make_pressure_vector() const {
    PetscHandle<Vec> v = livetet::make_vector(*pressure_);
    if (single() && share_.ranks == 1) run_on_team(v.get(), team_);
    return v;
}

void LevelAssembler::find_moduli(std::span<const Material> materials, const ModelChoice& model) {
    for (const Material& m : materials) {
        const ModelChoice& own = m.model ? m.model : model;
        moduli_.push_back({m.lambda(), m.mu(), m.density_kg_per_m3, own});
        is_linear_ = is_linear_ && own->kinematics() == Kinematics::small_strain;
        rotates_ = rotates_ || own->kinematics() == Kinematics::corotated;
    }
    for (std::size_t e = 0; e < share_.tets.size(); ++e) {
        const Material& m = material_of(materials, share_.regions.empty() ? 0 : share_.regions[e]);
        if (materials.size() > 1)
            moduli_of_tet_.push_back(static_cast<std::int32_t>(&m - materials.data()));
    }
}

bool LevelAssembler::is_batched() const {
    if (!share_.quadratic_hexahedra.empty()) return false;
    std::vector<const ConstitutiveModel*> models;
    for (const Moduli& m : moduli_) models.push_back(&*m.model);
    return why_not_batched(share_.is_quadratic(), is_mixed(), models).empty();
}

void LevelAssembler::find_mass() {
    node_mass_.assign(share_.owned, 0);
    with_shape([&](auto count) {
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const auto element = shaped_element<count()>(e);
            const double mass = moduli(e).density * element.volume;
            const auto shares = mass_shares<count()>(element);
            for (int i = 0; i < count(); ++i)
                if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                    node_mass_[n] += mass * shares[i];
        }
    });
}

double LevelAssembler::matrix_bytes() const {
    if (!matrix_) return 0;
    MatInfo info;
    LIVETET_PETSC(MatGetInfo(matrix_->get(), MAT_LOCAL, &info));
    return info.memory + matrix_->pattern().bytes();
}

MappedHexahedron LevelAssembler::mapped_element(std::size_t e) const {
    Nodal<27> x;
    for (int i = 0; i < 27; ++i) x.col(i) = share_.rest[share_.quadratic_hexahedra[e][i]];
    return make_mapped_hexahedron(x, share_.shares.empty() ? 1 : share_.shares[e], moduli(e).lambda,
                                  moduli(e).mu);
}

Eigen::Matrix4d LevelAssembler::pressure_mass(std::size_t e) const {
    if (share_.quadratic_hexahedra.empty())  // of barycentric coordinates over a tet
        return element(e).volume / 20 * (Eigen::Matrix4d::Ones() + Eigen::Matrix4d::Identity());
    const MappedHexahedron hexahedron = mapped_element(e);
    Eigen::Matrix4d mass = Eigen::Matrix4d::Zero();
    for (int point = 0; point < ElementShape<27>::points; ++point) {
        const Eigen::Vector4d L = pressure_shape(hexahedron, point);
        mass += element_point(hexahedron, point).weight * L * L.transpose();
    }
    return mass;
}

TetElement LevelAssembler::element(std::size_t e) const {
    if (!share_.quadratic_hexahedra.empty()) return mapped_element(e);
    const Tet& t = share_.tets[e];
    const Moduli& m = moduli(e);
    TetElement element =
        make_element({share_.rest[t[0]], share_.rest[t[1]], share_.rest[t[2]], share_.rest[t[3]]},
                     m.lambda, m.mu);
    if (!share_.volumes.empty()) element.volume = share_.volumes[e];
    return element;
}

Eigen::AlignedBox3d LevelAssembler::bounding_box() const {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : share_.rest) box.extend(x);
    MPI_Allreduce(MPI_IN_PLACE, box.min().data(), 3, MPI_DOUBLE, MPI_MIN, share_.comm);
    MPI_Allreduce(MPI_IN_PLACE, box.max().data(), 3, MPI_DOUBLE, MPI_MAX, share_.comm);
    return box;
}

TetElement LevelAssembler::operator_element(std::size_t e) const {
    TetElement of_operator = element(e);
    if (is_mixed()) of_operator.lambda = matrix_ ? 0 : least_mu();
    return of_operator;
}

std::vector<TetElement> LevelAssembler::elements() const {
    std::vector<TetElement> all;
    all.reserve(share_.tets.size());
    for (std::size_t e = 0; e < share_.tets.size(); ++e) all.push_back(operator_element(e));
    return all;
}

double LevelAssembler::least_mu() const {
    double least = std::numeric_limits<double>::max();
    for (const Moduli& m : moduli_) least = std::min(least, m.mu);
    return least;
}

void LevelAssembler::set_constrained(std::span<const std::uint8_t> components) {
    constrained_ = with_ghosts(share_, components.first(share_.owned));
    if (matrix_) matrix_->set_constrained(constrained_);
    if (single_) find_constrained_batches();
}

void LevelAssembler::set_springs(std::span<const double> stiffness) {
    springs_.clear();
    if (!stiffness.empty()) springs_.assign(stiffness.begin(), stiffness.begin() + share_.owned);
}

ElementRotations LevelAssembler::make_rotations() const {
    ElementRotations rotations;
    if (single_) {
        rotations.single = TetBatches<float>::make_fixed_rotations();
        if (keeps_displacement()) rotations.single_u.assign(3 * share_.nodes.size() + 1, 0.0F);
        if (!rotates_) return rotations;
        // Of each point where they belong to the law, else of each tet.
        rotations.single.assign(
            has_hooke_batches()
                ? std::visit([](const auto& b) { return b.points * b.all().end; }, single_->batches)
                : single_->batch_count(),
            rotations.single.front());
    } else if (batches_) {
        rotations.batches =
            rotates_ ? std::visit([](const auto& b) { return b.make_rotations(); }, *batches_)
                     : TetBatches<double>::make_fixed_rotations();
    } else if (rotates_) {
        const int points =
            with_shape([](auto count) { return ElementShape<decltype(count)::value>::points; });
        rotations.points.assign(share_.tets.size() * points, Eigen::Matrix3d::Identity());
    }
    return rotations;
}

ElementRotations LevelAssembler::make_rotations_of_cells() const {
    ElementRotations rotations;
    rotations.single = TetBatches<float>::make_fixed_rotations();
    if (!rotates_) return rotations;
    rotations.single.assign(single_->batch_count(), rotations.single.front());
    rotations.single_u.assign(3 * share_.nodes.size() + 1, 0.0F);
    return rotations;
}

void LevelAssembler::update_rotations(Vec u, ElementRotations& rotations) const {
    if (!rotates_ && !keeps_displacement()) return;
    const LocalValues values(u);
    if (single_) {
        std::vector<float>& to = rotations.single_u;
        team_.run_pieces(to.size() - 1, 450, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) to[i] = static_cast<float>(values.data()[i]);
        });
        update_single_rotations(rotations);
        return;
    }
    if (batches_) {
        std::visit(
            [&](const auto& batches) {
                team_.run_pieces(batches.all().end, 150, [&](std::size_t begin, std::size_t end) {
                    livetet::update_rotations(batches, {begin, end}, all_of(values, share_),
                                              std::span(rotations.batches));
                });
            },
            *batches_);
        return;
    }
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            if (moduli(e).model->kinematics() != Kinematics::corotated) continue;
            const auto element = shaped_element<nodes>(e);
            const Nodal<nodes> nodal = values_at<nodes>(e, values.data());
            for (int point = 0; point < Shape::points; ++point)
                rotations.points[e * Shape::points + point] =
                    rotation_of(Eigen::Matrix3d::Identity() +
                                nodal * element_point<nodes>(element, point).gradients.transpose());
        }
    });
}

namespace {

/// Adds the matrix of a local element. Skips rows of nodes that other ranks own.
template <class Matrix>
void add_element(BlockMatrix::Filling& matrix, const BlockPattern& pattern,
                 const PartitionedMesh& share, std::size_t e, const Matrix& K) {
    constexpr int nodes = Matrix::ColsAtCompileTime / 3;
    for (int i = 0; i < nodes; ++i) {
        const std::int32_t row = share.node(e, i);
        if (row >= share.owned) continue;
        for (int j = 0; j < nodes; ++j) {
            const std::int32_t column = share.node(e, j);
            matrix.add(row, column, pattern.place(e, i, j, row, column),
                       K.template block<3, 3>(3 * i, 3 * j));
        }
    }
}

}  // namespace

void LevelAssembler::add_stiffness(BlockMatrix::Filling& matrix, const Configuration& at,
                                   double factor, Tangent tangent) {
    const BlockPattern& pattern = matrix_->pattern();
    const bool is_frozen = is_linear_ || tangent == Tangent::frozen_rotation;
    if (batches_ && share_.edge_nodes.empty() && matrix_->layout() == MatrixLayout::blocks) {
        const LocalValues u(at.u);
        for (int part = 0; part < (share_.ghosts() ? 2 : 1); ++part)
            over_batches([&](BatchRange range) {
                if (is_frozen)
                    livetet::assemble<double>(four_node_batches(), range, at.rotations->batches,
                                              factor, pattern, matrix.blocks(part), part);
                else
                    assemble_exact_tangent(four_node_batches(), range, at.rotations->batches,
                                           all_of(u, share_), tangent, factor, pattern,
                                           matrix.blocks(part), part);
            });
        return;
    }
    std::vector<double> of_element;
    visit_points(
        at, [&]<int nodes>(const ConstitutiveModel& model, std::size_t e, const TetElement& element,
                           int number, const ElementPoint<nodes>& point, const Eigen::Matrix3d& H,
                           const Eigen::Matrix3d& R, double p) {
            using Matrix = ElementMatrix<nodes>;
            if (number == 0) of_element.assign(Matrix::SizeAtCompileTime, 0);
            Eigen::Map<Matrix> K(of_element.data());
            add_stiffness_of_point(model, tangent, factor * point.weight, element.mu,
                                   is_mixed() ? 0 : element.lambda, p, H, R, point.gradients, K);
            if (number + 1 == ElementShape<nodes>::points)
                add_element(matrix, pattern, share_, e, K);
        });
}

void LevelAssembler::keep_damping(const Configuration& at) {
    if (copy_) {
        damping_rotations_ = *at.rotations;
        keeps_damping_rotations_ = true;
    }
    if (is_grid_without_matrix()) keep_grid_damping(at);
    if (!matrix_) return;
    if (!damping_) {
        damping_ = std::make_unique<BlockMatrix>(share_, matrix_->layout());
        damping_force_ = make_vector();
    }
    BlockMatrix::Filling matrix(*damping_);
    add_stiffness(matrix, at, 1, Tangent::frozen_rotation);
    matrix.finish();
}

void LevelAssembler::add_damping_times(double factor, Vec v, Vec f) const {
    if (copy_) return add_stiffness_times(factor, {.rotations = &damping_rotations_}, v, f);
    if (is_grid_without_matrix())
        return add_grid_damping_times(factor, ReadArray(v).span(), WriteArray(f).span());
    LIVETET_PETSC(MatMult(damping_->get(), v, damping_force_.get()));
    LIVETET_PETSC(VecAXPY(f, factor, damping_force_.get()));
}

void LevelAssembler::assemble(const Configuration& at, const OperatorTerms& terms) {
    BlockMatrix::Filling matrix(*matrix_);
    add_stiffness(matrix, at, terms.stiffness, terms.tangent);
    if (terms.damping != 0) matrix.add(*damping_, terms.damping);
    for (std::int32_t i = 0; i < share_.owned; ++i)
        matrix.add_diagonal(i, (terms.mass != 0 ? terms.mass * node_mass_[i] : 0) +
                                   (springs_.empty() ? 0 : springs_[i]));
    matrix.finish();
}

double LevelAssembler::force_epsilon() const {
    return single_ ? std::numeric_limits<float>::epsilon()
                   : 16 * std::numeric_limits<double>::epsilon();
}

void LevelAssembler::elastic_force(const Configuration& at, Vec f) const {
    if (single_ && is_mixed()) {
        WriteArray forces(f);
        std::vector<float>& sum = single_->forces;
        over_components([&](std::size_t i) { sum[i] = 0; });
        take_pressures(at.p, single_->pressures);
        add_mixed_forces(*at.rotations, single_->pressures, {sum, {}});
        over_components([&](std::size_t i) { forces[i] = sum[i]; });
        return;
    }
    if (batches_ || single_) {
        frozen_force(at.u, *at.rotations, f);
        return;
    }
    LIVETET_PETSC(VecSet(f, 0));
    WriteArray forces(f);
    visit_points(
        at, [&](const ConstitutiveModel& model, std::size_t e, const TetElement& element, int,
                const auto& point, const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, double p) {
            const auto nodal =
                (point.weight * model.stress(element.mu, p, H, R) * point.gradients).eval();
            for (int i = 0; i < nodal.cols(); ++i)
                if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                    Eigen::Map<Eigen::Vector3d>(forces.span().data() + 3 * n) += nodal.col(i);
        });
}

double LevelAssembler::force_at_unit_strain() const {
    std::vector<double> force(share_.owned, 0.0);
    for (std::size_t e = 0; e < share_.tets.size(); ++e) {
        const TetElement t = element(e);
        for (int i = 0; i < share_.nodes_per_tet(); ++i)
            if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                force[n] += ((is_mixed() ? 0 : std::abs(t.lambda)) + 2 * t.mu) * t.volume *
                            t.gradients.col(i % 4).norm();
    }
    double sum = 0;
    for (const double f : force) sum += f * f;
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, share_.comm);
    return std::sqrt(sum);
}

double LevelAssembler::strain_energy(const Configuration& at) const {
    double energy = 0;
    visit_fields(at, [&](std::size_t e, const TetFields& fields) {
        // Shared by the ranks that own its corners, so that each tet counts once.
        const Tet& t = share_.tets[e];
        const auto owned =
            std::count_if(t.begin(), t.end(), [&](std::int32_t n) { return n < share_.owned; });
        energy +=
            0.25 * static_cast<double>(owned) * element(e).volume * fields.strain_energy_J_per_m3;
    });
    MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, share_.comm);
    return energy;
}

}  // namespace livetet
