#include "apps/scene/model_limits.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "mechanics/materials/kinematics.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;

Matrix3d edges_of(const Tet& tet, std::span<const Vector3> places) {
    Matrix3d edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = places[tet[i + 1]] - places[tet[0]];
    return edges;
}

/// Strain and rotation of a tet with displacement gradient H.
struct Deformation {
    double strain = 0, rotation_rad = 0;

    Deformation(const Matrix3d& H, Kinematics kinematics) {
        const bool small = kinematics == Kinematics::small_strain;
        const Matrix3d measure =
            small ? Matrix3d(0.5 * (H + H.transpose())) : twice_green_strain(H);
        Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
        solver.computeDirect(measure, Eigen::EigenvaluesOnly);
        for (const double e : solver.eigenvalues()) {
            const double own = small ? e : std::sqrt(std::max(0.0, 1 + e)) - 1;
            strain = std::max(strain, std::abs(own));
        }
        rotation_rad =
            0.5 * Vector3(H(2, 1) - H(1, 2), H(0, 2) - H(2, 0), H(1, 0) - H(0, 1)).norm();
    }
};

/// How far a model's tets go beyond its limits.
struct Excess {
    double volume = 0, strained = 0, turned = 0;  ///< m^3: all, beyond strain, beyond rotation
    double max_strain = 0, max_rotation_rad = 0;

    void add(const Deformation& d, const ModelLimits& limits, double of_tet) {
        volume += of_tet;
        if (d.strain > limits.strain) strained += of_tet;
        if (limits.rotation_rad && d.rotation_rad > *limits.rotation_rad) turned += of_tet;
        max_strain = std::max(max_strain, d.strain);
        max_rotation_rad = std::max(max_rotation_rad, d.rotation_rad);
    }
};

void add_sentences(const ConstitutiveModel& model, const Excess& excess,
                   std::vector<std::string>& sentences) {
    const ModelLimits limits = limits_of(model.kinematics());
    const double tolerated = ModelLimits::tolerated_share * excess.volume;
    if (excess.strained > tolerated)
        sentences.push_back(fmt::format(
            "Strains are above {:.0f} %, up to which the model {} stands, in {:.0f} % of its "
            "volume; the largest is {:.0f} %.",
            100 * limits.strain, model.name(), 100 * excess.strained / excess.volume,
            100 * excess.max_strain));
    if (excess.turned > tolerated)
        sentences.push_back(fmt::format(
            "Rotations are above {:.0f} degrees, up to which the model {} stands, in {:.0f} % of "
            "its volume; the largest is {:.0f} degrees.",
            *limits.rotation_rad * 180 / std::numbers::pi, model.name(),
            100 * excess.turned / excess.volume, excess.max_rotation_rad * 180 / std::numbers::pi));
}

/// Of a displacement: what decides whether it can be meant.
struct Findings {
    double largest = 0;  ///< displacement, m
    Eigen::AlignedBox3d box;
    std::vector<std::pair<const ConstitutiveModel*, Excess>> of_models;  ///< by material

    /// Of all ranks, from those of each.
    void reduce(MPI_Comm comm) {
        std::vector<double> sums, most{largest};
        for (const auto& [model, e] : of_models) {
            sums.insert(sums.end(), {e.volume, e.strained, e.turned});
            most.insert(most.end(), {e.max_strain, e.max_rotation_rad});
        }
        for (int c = 0; c < 3; ++c) most.insert(most.end(), {box.max()[c], -box.min()[c]});
        sum_over_ranks(comm, sums);
        MPI_Allreduce(MPI_IN_PLACE, most.data(), static_cast<int>(most.size()), MPI_DOUBLE, MPI_MAX,
                      comm);
        const double *sum = sums.data(), *at = most.data();
        largest = *at++;
        for (auto& [model, e] : of_models) {
            e = {sum[0], sum[1], sum[2], at[0], at[1]};
            sum += 3, at += 2;
        }
        for (int c = 0; c < 3; ++c, at += 2) box.max()[c] = at[0], box.min()[c] = -at[1];
    }
};

Findings findings_of(const Scene& scene, const TetMesh& mesh, std::span<const Vector3> displacement,
                     std::int32_t owned) {
    Findings found;
    for (const Vector3& x : mesh.nodes) found.box.extend(x);
    for (const Vector3& u : displacement) found.largest = std::max(found.largest, u.norm());
    std::map<const ConstitutiveModel*, std::size_t> place_of;
    for (const Material& m : scene.materials)
        if (const auto* model = &model_of(m, scene.strain);
            place_of.try_emplace(model, found.of_models.size()).second)
            found.of_models.push_back({model, {}});
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        if (mesh.tets[e][0] >= owned) continue;  // its owner counts it
        const int region = mesh.regions.empty() ? 0 : mesh.regions[e];
        const ConstitutiveModel& model =
            model_of(material_of(scene.materials, region), scene.strain);
        const Matrix3d rest = edges_of(mesh.tets[e], mesh.nodes);
        const Matrix3d H = edges_of(mesh.tets[e], displacement) * rest.inverse();
        found.of_models[place_of.at(&model)].second.add({H, model.kinematics()},
                                                        limits_of(model.kinematics()),
                                                        std::abs(rest.determinant()) / 6);
    }
    return found;
}

std::vector<Material>::const_iterator least_compressible(const Scene& scene) {
    return std::ranges::max_element(scene.materials, {}, &Material::poisson);
}

/// Poisson's ratio from which Newmark's steps do not damp fast swings of the volume.
constexpr double swings_from = 0.499;

bool may_swing(const Scene& scene) {
    return scene.time.scheme == TimeScheme::newmark &&
           least_compressible(scene)->poisson >= swings_from;
}

bool is_mixed(const Scene& scene) {
    return resolved_formulation(elastic_model(scene)) == Formulation::mixed;
}

}  // namespace

ModelLimits limits_of(Kinematics kinematics) {
    switch (kinematics) {
        case Kinematics::small_strain:
            return {.strain = 0.05, .rotation_rad = 0.1};
        case Kinematics::corotated:
            return {.strain = 0.5, .rotation_rad = {}};
        case Kinematics::finite_strain:
            break;
    }
    return {};
}

std::vector<std::string> beyond_model(const Scene& scene, const TetMesh& mesh,
                                      std::span<const Vector3> displacement,
                                      const PartitionedMesh* share) {
    const auto owned = share ? share->owned : static_cast<std::int32_t>(mesh.nodes.size());
    Findings found = findings_of(scene, mesh, displacement, owned);
    if (share && share->ranks > 1) found.reduce(share->comm);
    std::vector<std::string> sentences;
    if (const double size = found.box.diagonal().norm(); found.largest > size)
        sentences.push_back(fmt::format(
            "The largest displacement, {:.4g} mm, is above the body's size, {:.4g} mm: check "
            "loads, moduli, units and what is fixed.",
            1e3 * found.largest, 1e3 * size));
    for (const auto& [model, excess] : found.of_models) add_sentences(*model, excess, sentences);
    return sentences;
}

std::optional<std::string> locking_note(const Scene& scene) {
    const auto stiffest = least_compressible(scene);
    if (stiffest->poisson < 0.49 || is_mixed(scene)) return {};
    return fmt::format(
        "materials[{}].poisson = {:g} with formulation: displacement: elements made of "
        "displacements alone lock near 0.5 and are too stiff. Reactions of a pressed liver of "
        "60,000 tets are 1.2 times too large at 0.49, 2.0 times at 0.499 and 7.5 times at 0.4999; "
        "coarser meshes lock more. Expected below 0.49, or formulation: mixed.",
        stiffest - scene.materials.begin(), stiffest->poisson);
}

int newton_iterations_of_frame(const Scene& scene) {
    if (scene.track && scene.track->newton_iterations) return *scene.track->newton_iterations;
    return may_swing(scene) && is_mixed(scene) ? 2 : 1;
}

std::optional<std::string> swinging_note(const Scene& scene, const TetMesh& mesh) {
    if (!scene.track || !may_swing(scene)) return {};
    const bool swings = is_mixed(scene) && newton_iterations_of_frame(scene) == 1;
    if (!swings && mesh.hexahedra.empty()) return {};
    const auto stiffest = least_compressible(scene);
    return fmt::format(
        "materials[{}].poisson = {:g} with time.scheme: newmark{}. Expected time.scheme: "
        "generalized_alpha or euler, {}or a poisson below {:g}.",
        stiffest - scene.materials.begin(), stiffest->poisson,
        mesh.hexahedra.empty() ? " and track.linearisations: 1: the body may keep swinging"
                               : " on hexahedra: deep presses may tear the mesh",
        mesh.hexahedra.empty() ? "track.linearisations: 2, " : "", swings_from);
}

}  // namespace livetet
