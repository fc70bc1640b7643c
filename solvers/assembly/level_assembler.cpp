#include "solvers/assembly/level_assembler.hpp"

#include <algorithm>
#include <limits>

#include "mechanics/rotation.hpp"
#include "solvers/assembly/batch_support.hpp"
#include "solvers/assembly/level_assembler_points.hpp"
#include "solvers/assembly/pointwise_law.hpp"

namespace livetet {

namespace {

/// Forces at all local nodes. Those on ghosts are not read: their owners compute them.
class LocalForces {
  public:
    explicit LocalForces(Vec f) : vec_(f) {
        LIVETET_PETSC(VecGhostGetLocalForm(f, &local_));
        LIVETET_PETSC(VecGetArray(local_, &data_));
    }
    ~LocalForces() {
        VecRestoreArray(local_, &data_);
        VecGhostRestoreLocalForm(vec_, &local_);
    }
    LocalForces(const LocalForces&) = delete;
    LocalForces& operator=(const LocalForces&) = delete;
    std::span<double> span(const PartitionedMesh& share) { return {data_, 3 * share.nodes.size()}; }

  private:
    Vec vec_;
    Vec local_ = nullptr;
    PetscScalar* data_ = nullptr;
};

/// Parts of the first round (see BatchParts). More than there are threads, so that these find work
/// when one of them has lost its core; whatever their number, so that results are the same. Smaller
/// parts would wait for each other longer than they take.
int part_count(std::size_t tets) {
    constexpr std::size_t tets_a_part = 100, most = 8;
    return static_cast<int>(std::clamp<std::size_t>(tets / tets_a_part, 1, most));
}

}  // namespace

LevelAssembler::LevelAssembler(PartitionedMesh share, std::span<const Material> materials,
                               const ModelChoice& model, Formulation formulation,
                               LevelStorage storage, ThreadTeam& team)
    : share_(std::move(share)), team_(team), constrained_(share_.nodes.size(), 0) {
    find_moduli(materials, model);
    if (!share_.hexahedra.empty())
        has_mean_dilation_ = formulation == Formulation::mixed;
    else if (formulation == Formulation::mixed)
        pressure_ = make_pressure_space(share_);
    if (const auto* layout = std::get_if<MatrixLayout>(&storage)) {
        if (is_batched()) make_double_batches();
        matrix_.emplace(share_, *layout);
    } else if (std::holds_alternative<SinglePrecision>(storage)) {
        make_single_batches();
    }
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
    std::vector<const ConstitutiveModel*> models;
    for (const Moduli& m : moduli_) models.push_back(&*m.model);
    return why_not_batched(share_.is_quadratic(), is_mixed(), models).empty();
}

void LevelAssembler::find_mass() {
    node_mass_.assign(share_.owned, 0);
    with_shape([&](auto count) {
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            const double mass = moduli(e).density * element(e).volume;
            for (int i = 0; i < count(); ++i)
                if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                    node_mass_[n] += mass * ElementShape<decltype(count)::value>::mass_share(i);
        }
    });
}

double LevelAssembler::matrix_bytes() const {
    if (!matrix_) return 0;
    MatInfo info;
    LIVETET_PETSC(MatGetInfo(matrix_->get(), MAT_LOCAL, &info));
    return info.memory + matrix_->pattern().bytes();
}

TetElement LevelAssembler::element(std::size_t e) const {
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

void LevelAssembler::make_double_batches() {
    parts_ = part_batches(share_.tets, 1, batch_width<double>);
    batches_.emplace([this](std::size_t e) { return operator_element(e); }, share_.tets, parts_);
    std::vector<std::int32_t>().swap(parts_.tet_of_lane);  // lanes are in the order of the tets
}

const BatchLaw* LevelAssembler::shared_law() const {
    const ConstitutiveModel& first = *moduli_.front().model;
    for (const Moduli& m : moduli_)
        if (m.model->name() != first.name()) return nullptr;
    return first.is_hooke_by_rotation() ? &hooke_law() : first.batch_law();
}

void LevelAssembler::make_single_batches() {
    const std::vector<float> zeros(3 * share_.nodes.size() + 1);
    const BatchLaw* law = shared_law();
    std::unique_ptr<const BatchLaw> own;
    if (!law) {
        std::vector<PointwiseModels::Moduli> moduli;
        for (const Moduli& m : moduli_) moduli.push_back({m.lambda, m.mu, m.model});
        own = std::make_unique<PointwiseLaw>(PointwiseModels(std::move(moduli), moduli_of_tet_));
        law = own.get();
    }
    const auto make = [&](const auto& nodes) {
        constexpr int count = std::tuple_size_v<std::remove_cvref_t<decltype(nodes[0])>>;
        parts_ = part_batches(nodes, part_count(nodes.size()), batch_width<float>);
        single_ = std::make_unique<SinglePrecisionBatches>(
            TetBatches<float, count>([this](std::size_t e) { return operator_element(e); }, nodes,
                                     parts_),
            *law, std::move(own), zeros, zeros);
    };
    // The preconditioner's operator is Hooke's law turned by the rotations, whatever the law.
    rotates_ = !is_linear_;
    if (!share_.hexahedra.empty()) {
        make(share_.hexahedra);
    } else if (share_.edge_nodes.empty()) {
        make(share_.tets);
    } else {
        std::vector<std::array<std::int32_t, 10>> nodes(share_.tets.size());
        for (std::size_t e = 0; e < nodes.size(); ++e)
            for (int i = 0; i < 10; ++i) nodes[e][i] = share_.node(e, i);
        make(nodes);
    }
    number_lanes();
    if (is_mixed()) make_single_pressures();
}

void LevelAssembler::make_single_pressures() {
    single_->per_modulus = static_cast<float>(1 / least_mu());
    single_->node_of_pressure.resize(pressure_->numbers.size());
    for (std::size_t e = 0; e < share_.tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            single_->node_of_pressure[pressure_->tets[e][i]] = share_.tets[e][i];
    single_->pressures.assign(share_.nodes.size(), 0.0F);
}

void LevelAssembler::number_lanes() {
    lane_of_tet_.resize(share_.tets.size());
    for (std::size_t lane = 0; lane < parts_.tet_of_lane.size(); ++lane)
        if (const std::int32_t e = parts_.tet_of_lane[lane]; e >= 0)
            lane_of_tet_[e] = static_cast<std::int32_t>(lane);
}

void LevelAssembler::set_constrained(std::span<const std::uint8_t> components) {
    constrained_ = with_ghosts(share_, components.first(share_.owned));
    if (matrix_) matrix_->set_constrained(constrained_);
    if (single_) find_constrained_batches();
}

void LevelAssembler::find_constrained_batches() {
    constrained_batches_.clear();
    std::visit(
        [&](const auto& batches) {
            const auto is_at_constrained = [&](std::size_t b) {
                for (const auto& offsets : batches[b].offset)
                    for (const std::int32_t offset : offsets)
                        if (constrained_[offset / 3]) return true;
                return false;
            };
            for (std::size_t b = 0; b < batches.all().end; ++b) {
                if (!is_at_constrained(b)) continue;
                if (!constrained_batches_.empty() && constrained_batches_.back().end == b)
                    ++constrained_batches_.back().end;
                else
                    constrained_batches_.push_back({b, b + 1});
            }
        },
        single_->batches);
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
            rotates_ ? batches_->make_rotations() : TetBatches<double>::make_fixed_rotations();
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
        team_.run_pieces(batches_->all().end, 150, [&](std::size_t begin, std::size_t end) {
            livetet::update_rotations<double>(*batches_, {begin, end}, all_of(values, share_),
                                              rotations.batches);
        });
        return;
    }
    with_shape([&](auto count) {
        constexpr int nodes = decltype(count)::value;
        using Shape = ElementShape<nodes>;
        for (std::size_t e = 0; e < share_.tets.size(); ++e) {
            if (moduli(e).model->kinematics() != Kinematics::corotated) continue;
            const TetElement element = this->element(e);
            const Nodal<nodes> nodal = values_at<nodes>(e, values.data());
            for (int point = 0; point < Shape::points; ++point)
                rotations.points[e * Shape::points + point] =
                    rotation_of(Eigen::Matrix3d::Identity() +
                                nodal * Shape::gradients(element, point).transpose());
        }
    });
}

void LevelAssembler::update_single_rotations(ElementRotations& rotations) const {
    if (!rotates_) return;
    std::visit(
        [&](const auto& batches) {
            team_.run_pieces(batches.all().end, 75, [&](std::size_t begin, std::size_t end) {
                livetet::update_rotations(batches, {begin, end},
                                          std::span<const float>(rotations.single_u),
                                          std::span(rotations.single));
            });
        },
        single_->batches);
}

void LevelAssembler::add_stiffness(BlockMatrix::Filling& matrix, const Configuration& at,
                                   double factor, Tangent tangent) {
    const BlockPattern& pattern = matrix_->pattern();
    const bool is_frozen = is_linear_ || tangent == Tangent::frozen_rotation;
    if (batches_ && matrix_->layout() == MatrixLayout::blocks) {
        const LocalValues u(at.u);
        for (int part = 0; part < (share_.ghosts() ? 2 : 1); ++part)
            over_batches([&](BatchRange range) {
                if (is_frozen)
                    livetet::assemble<double>(*batches_, range, at.rotations->batches, factor,
                                              pattern, matrix.blocks(part), part);
                else
                    assemble_exact_tangent(*batches_, range, at.rotations->batches,
                                           all_of(u, share_), tangent, factor, pattern,
                                           matrix.blocks(part), part);
            });
        return;
    }
    visit_points(at, [&](const ConstitutiveModel& model, auto shape, std::size_t e,
                         const TetElement& element, int, const auto& g, const Eigen::Matrix3d& H,
                         const Eigen::Matrix3d& R, double p) {
        visit_stiffness(model, tangent, factor * element.volume / shape.points, element.mu,
                        is_mixed() ? 0 : element.lambda, p, H, R, g,
                        [&](int i, int j, const Eigen::Matrix3d& K) {
                            const std::int32_t row = share_.node(e, i), column = share_.node(e, j);
                            if (row < share_.owned)
                                matrix.add(row, column, pattern.place(e, i, j, row, column), K);
                        });
    });
}

void LevelAssembler::keep_damping(const Configuration& at) {
    if (!damping_) {
        damping_ = std::make_unique<BlockMatrix>(share_, matrix_->layout());
        damping_force_ = make_vector(share_);
    }
    BlockMatrix::Filling matrix(*damping_);
    add_stiffness(matrix, at, 1, Tangent::frozen_rotation);
    matrix.finish();
}

void LevelAssembler::add_damping_times(double factor, Vec v, Vec f) const {
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

template <class Add>
void LevelAssembler::add_in_single(std::span<const double> from, std::span<double> to,
                                   Add&& add) const {
    SinglePrecisionBatches& single = *single_;
    over_components([&](std::size_t i) {
        single.values[i] = static_cast<float>(from[i]), single.forces[i] = 0;
    });
    add(std::span<const float>(single.values), std::span<float>(single.forces));
    over_components([&](std::size_t i) { to[i] += single.forces[i]; });
}

void LevelAssembler::add_single_products(float factor, Tangent tangent, const ElementRotations& at,
                                         std::span<const float> v, std::span<float> f,
                                         Support of_v) const {
    const BatchLaw& law = tangent == Tangent::exact ? single_->law : hooke_law();
    std::visit(
        [&](const auto& batches) {
            over_batches(
                [&](BatchRange range) {
                    law.add_stiffness_times(factor, batches, range, at.single, at.single_u, v, f);
                },
                of_v);
        },
        single_->batches);
}

double LevelAssembler::force_epsilon() const {
    return single_ ? std::numeric_limits<float>::epsilon()
                   : 16 * std::numeric_limits<double>::epsilon();
}

void LevelAssembler::frozen_force(Vec y, const ElementRotations& rotations, Vec f) const {
    {
        LocalForces forces(f);
        const auto to = forces.span(share_);
        team_.run_pieces(to.size(), 1000, [&](std::size_t begin, std::size_t end) {
            std::fill(to.begin() + static_cast<std::ptrdiff_t>(begin),
                      to.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
        });
    }
    const LocalValues values(y);
    LocalForces forces(f);
    const auto from = all_of(values, share_);
    const auto to = forces.span(share_);
    if (single_) {
        add_in_single(from, to, [&](std::span<const float> u, std::span<float> added) {
            add_single_forces(rotations, u, added);
        });
        return;
    }
    over_batches([&](BatchRange range) {
        const std::span<const RotationBatch<double>> R(rotations.batches);
        if (is_linear_)
            livetet::add_stiffness_times<double>(1, *batches_, range, R, from, to);
        else
            livetet::add_forces<double>(*batches_, range, R, from, to);
    });
}

void LevelAssembler::add_single_forces(const ElementRotations& rotations, std::span<const float> u,
                                       std::span<float> f) const {
    if (is_linear_) {
        add_single_products(1, Tangent::exact, rotations, u, f);
        return;
    }
    std::visit(
        [&](const auto& batches) {
            over_batches([&](BatchRange range) {
                single_->law.add_forces(batches, range, rotations.single, u, f);
            });
        },
        single_->batches);
}

void LevelAssembler::take_pressures(Vec p, std::span<float> of_nodes) const {
    const ReadArray values(p);
    for (std::size_t i = 0; i < single_->node_of_pressure.size(); ++i)
        of_nodes[single_->node_of_pressure[i]] = static_cast<float>(values[i]);
}

template <class Work>
void LevelAssembler::over_mixed_batches(const ElementRotations& at, Work&& work,
                                        Support support) const {
    std::visit(
        [&]<int nodes>(const TetBatches<float, nodes>& batches) {
            if constexpr (nodes != 8)  // hexahedra have no pressures (see why_not_live)
                over_batches(
                    [&](BatchRange range) {
                        work(single_->law.mixed(),
                             MixedTets<nodes>{batches, single_->per_modulus, range, at.single});
                    },
                    support);
        },
        single_->batches);
}

void LevelAssembler::add_mixed_forces(const ElementRotations& at, std::span<const float> p,
                                      const MixedForces& to) const {
    over_mixed_batches(at, [&](const MixedLaw& law, const auto& tets) {
        law.add_forces(tets, {at.single_u, p}, to);
    });
}

void LevelAssembler::add_mixed_products(float factor, const ElementRotations& at,
                                        std::span<const float> p, const MixedValues& v,
                                        const MixedForces& to, Support of_v) const {
    over_mixed_batches(
        at,
        [&](const MixedLaw& law, const auto& tets) {
            law.add_products(tets, factor, {at.single_u, p}, v, to);
        },
        of_v);
}

void LevelAssembler::add_pressure_forces(const ElementRotations& at, std::span<const float> q,
                                         std::span<float> f) const {
    over_mixed_batches(at, [&](const MixedLaw& law, const auto& tets) {
        law.add_pressure_forces(tets, {at.single_u, {}}, q, f);
    });
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
    visit_points(at, [&](const ConstitutiveModel& model, auto shape, std::size_t e,
                         const TetElement& element, int, const auto& g, const Eigen::Matrix3d& H,
                         const Eigen::Matrix3d& R, double p) {
        const double weight = element.volume / shape.points;
        const auto nodal = (weight * model.stress(element.mu, p, H, R) * g).eval();
        for (int i = 0; i < nodal.cols(); ++i)
            if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                Eigen::Map<Eigen::Vector3d>(forces.span().data() + 3 * n) += nodal.col(i);
    });
}

void LevelAssembler::add_stiffness_times(double factor, const Configuration& at, Vec v, Vec f,
                                         Support of_v) const {
    if (batches_ || single_) {
        const LocalValues direction(v);
        LocalForces forces(f);
        const auto from = all_of(direction, share_);
        const auto to = forces.span(share_);
        if (single_)
            add_in_single(from, to, [&](std::span<const float> of, std::span<float> added) {
                if (is_mixed()) {
                    take_pressures(at.p, single_->pressures);
                    add_mixed_products(static_cast<float>(factor), *at.rotations,
                                       single_->pressures, {of, {}}, {added, {}}, of_v);
                    return;
                }
                add_single_products(static_cast<float>(factor), Tangent::exact, *at.rotations, of,
                                    added, of_v);
            });
        else
            over_batches([&](BatchRange range) {
                livetet::add_stiffness_times<double>(
                    factor, *batches_, range,
                    std::span<const RotationBatch<double>>(at.rotations->batches), from, to);
            });
        return;
    }
    const LocalValues direction(v);
    WriteArray forces(f);
    if (!share_.hexahedra.empty()) {
        add_hexahedra_times(factor, Tangent::frozen_rotation, at, all_of(direction, share_),
                            forces.span());
        return;
    }
    visit_points(at, [&](const ConstitutiveModel& model, auto shape, std::size_t e,
                         const TetElement& element, int, const auto& g, const Eigen::Matrix3d& H,
                         const Eigen::Matrix3d& R, double p) {
        constexpr int nodes = std::remove_cvref_t<decltype(g)>::ColsAtCompileTime;
        const Eigen::Matrix3d dF = values_at<nodes>(e, direction.data()) * g.transpose();
        Eigen::Matrix3d dP = model.shear_stress_increment(element.mu, p, H, R, dF);
        if (!is_mixed()) {
            const Eigen::Matrix3d N = model.volume_strain_gradient(H, R);
            dP += element.lambda * N.cwiseProduct(dF).sum() * N;
        }
        const auto nodal = (factor * element.volume / shape.points * dP * g).eval();
        for (int i = 0; i < nodes; ++i)
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
