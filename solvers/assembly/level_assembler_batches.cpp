// The part of LevelAssembler that computes over batches.

#include <algorithm>

#include "solvers/assembly/level_assembler.hpp"
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

void LevelAssembler::make_copy() {
    with_nodes([&](const auto& nodes) {
        constexpr int count = std::tuple_size_v<std::remove_cvref_t<decltype(nodes[0])>>;
        copy_ = std::make_unique<SinglePrecisionBatches>(
            TetBatches<float, count>([this](std::size_t e) { return element(e); }, nodes),
            hooke_law(), nullptr, std::vector<float>(), std::vector<float>());
    });
}

void LevelAssembler::make_double_batches() {
    with_nodes([&](const auto& nodes) {
        constexpr int count = std::tuple_size_v<std::remove_cvref_t<decltype(nodes[0])>>;
        parts_ = part_batches(nodes, 1, batch_width<double>);
        batches_.emplace(
            std::in_place_type<TetBatches<double, count>>,
            [this](std::size_t e) { return operator_element(e); }, nodes, parts_);
    });
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
    if (!share_.hexahedra.empty())
        make(share_.hexahedra);
    else
        with_nodes(make);
    number_lanes();
    if (is_mixed()) make_single_pressures();
}

void LevelAssembler::make_single_pressures() {
    single_->per_modulus = static_cast<float>(1 / least_mu());
    const bool are_of_cells = !share_.hexahedra.empty();
    single_->pressure_places.resize(pressure_->numbers.size());
    for (std::size_t e = 0; e < share_.tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            single_->pressure_places[pressure_->tets[e][i]] =
                are_of_cells ? static_cast<std::int32_t>(e) : share_.tets[e][i];
    single_->pressures.assign(are_of_cells ? share_.tets.size() : share_.nodes.size(), 0.0F);
}

void LevelAssembler::number_lanes() {
    lane_of_tet_.resize(share_.tets.size());
    for (std::size_t lane = 0; lane < parts_.tet_of_lane.size(); ++lane)
        if (const std::int32_t e = parts_.tet_of_lane[lane]; e >= 0)
            lane_of_tet_[e] = static_cast<std::int32_t>(lane);
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

void LevelAssembler::round_rotations(const ElementRotations& from, ElementRotations& to) const {
    if (!rotates_) {
        if (to.single.empty()) to.single = TetBatches<float>::make_fixed_rotations();
        return;
    }
    // Lanes are in the order of the tets in both: two batches of doubles make one of floats.
    constexpr std::size_t half = batch_width<double>;
    const std::size_t points = std::visit([](const auto& b) { return b.points; }, *batches_);
    to.single.resize(points * copy_->batch_count());
    for (std::size_t k = 0; k < from.batches.size() / points; ++k)
        for (std::size_t q = 0; q < points; ++q)
            for (int m = 0; m < 4; ++m)
                for (std::size_t l = 0; l < half; ++l)
                    to.single[points * (k / 2) + q].quaternion[m][k % 2 * half + l] =
                        static_cast<float>(from.batches[points * k + q].quaternion[m][l]);
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
    const SinglePrecisionBatches& single = *this->single();
    const BatchLaw& law = tangent == Tangent::exact ? single.law : hooke_law();
    std::visit(
        [&](const auto& batches) {
            const auto add = [&](BatchRange range) {
                law.add_stiffness_times(factor, batches, range, at.single, at.single_u, v, f);
            };
            copy_ ? add(batches.all()) : over_batches(add, of_v);
        },
        single.batches);
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
    const std::span<const RotationBatch<double>> R(rotations.batches);
    over_double_batches([&](const auto& batches, BatchRange range) {
        if (is_linear_)
            livetet::add_stiffness_times(1.0, batches, range, R, from, to);
        else
            livetet::add_forces(batches, range, R, from, to);
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

void LevelAssembler::take_pressures(Vec p, std::span<float> places) const {
    const ReadArray values(p);
    for (std::size_t i = 0; i < single_->pressure_places.size(); ++i)
        places[single_->pressure_places[i]] = static_cast<float>(values[i]);
}

template <class Work>
void LevelAssembler::over_mixed_batches(const ElementRotations& at, Work&& work,
                                        Support support) const {
    std::visit(
        [&]<int nodes>(const TetBatches<float, nodes>& batches) {
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

void LevelAssembler::tangent_times(double factor, Tangent tangent, const Configuration& at, Vec v,
                                   Vec f) const {
    const LocalValues direction(v), u(at.u);
    LocalForces forces(f);
    const auto from = all_of(direction, share_), displacement = all_of(u, share_);
    const auto to = forces.span(share_);
    std::fill(to.begin(), to.end(), 0.0);
    const std::span<const RotationBatch<double>> R(at.rotations->batches);
    over_double_batches([&](const auto& batches, BatchRange range) {
        if (is_linear_ || tangent == Tangent::frozen_rotation)
            livetet::add_stiffness_times(factor, batches, range, R, from, to);
        else
            add_tangent_times(factor, batches, range, R, displacement, tangent, from, to);
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
            over_double_batches([&](const auto& batches, BatchRange range) {
                livetet::add_stiffness_times(
                    factor, batches, range,
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
    visit_points(
        at, [&]<int nodes>(const ConstitutiveModel& model, std::size_t e, const TetElement& element,
                           int, const ElementPoint<nodes>& point, const Eigen::Matrix3d& H,
                           const Eigen::Matrix3d& R, double p) {
            const auto& g = point.gradients;
            const Eigen::Matrix3d dF = values_at<nodes>(e, direction.data()) * g.transpose();
            Eigen::Matrix3d dP = model.shear_stress_increment(element.mu, p, H, R, dF);
            if (!is_mixed()) {
                const Eigen::Matrix3d N = model.volume_strain_gradient(H, R);
                dP += element.lambda * N.cwiseProduct(dF).sum() * N;
            }
            const auto nodal = (factor * point.weight * dP * g).eval();
            for (int i = 0; i < nodes; ++i)
                if (const std::int32_t n = share_.node(e, i); n < share_.owned)
                    Eigen::Map<Eigen::Vector3d>(forces.span().data() + 3 * n) += nodal.col(i);
        });
}

}  // namespace livetet
