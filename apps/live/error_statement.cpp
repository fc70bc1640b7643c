#include "apps/live/error_statement.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "geometry/error_ellipsoid.hpp"
#include "geometry/registration_covariance.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Matrix36d = Eigen::Matrix<double, 3, 6>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// What another constitutive law would change, as a share of what large strain changes.
constexpr double law_share = 0.3;

Matrix3d outer(const Vector3& v) { return v * v.transpose(); }

/// R J(at): how a place of the organ errs with the reference sensor's pose, along the axes of the
/// image.
Matrix36d by_reference(const PoseErrors& poses, const Vector3& at) {
    const Matrix3d& tracker_from_reference = poses.reference->rotation;
    const Matrix3d image_from_tracker =
        poses.image_from_reference.rotation * tracker_from_reference.transpose();
    const Vector3 in_reference = poses.image_from_reference.inverse() * at;
    return image_from_tracker * point_jacobian(tracker_from_reference * in_reference);
}

Matrix3d by_registration(const PoseErrors& poses, const Vector3& at) {
    if (!poses.registration) return Matrix3d::Zero();
    return point_covariance(poses.registration->covariance,
                            at - poses.image_from_reference.translation);
}

/// Sum of independent errors by their sources.
class ErrorSum {
  public:
    void add(ErrorSource source, const Matrix3d& covariance) {
        covariance_ += covariance;
        by_source_[static_cast<std::size_t>(source)] += covariance.trace();
    }
    TargetStatement at(const Vector3& position) const {
        const Matrix3d symmetric = 0.5 * (covariance_ + covariance_.transpose());
        return {position, symmetric, error_ellipsoid(symmetric).radius_95, by_source_};
    }

  private:
    Matrix3d covariance_ = Matrix3d::Zero();
    std::array<double, error_source_count> by_source_{};
};

/// What the pose and the place of one patch add to the error of a place.
void add_patch(ErrorSum& sum, const PatchResponse& r, const Eigen::Matrix<double, 6, 1>& motion,
               const PatchError* error, const Matrix3d& of_place) {
    if (error) sum.add(ErrorSource::sensors, r.motion * error->own * r.motion.transpose());
    Matrix3d moved;
    for (int axis = 0; axis < 3; ++axis) moved.col(axis) = r.gradient[axis] * motion.head<3>();
    sum.add(ErrorSource::patches, moved * of_place * moved.transpose());
}

/// Those of the targets; then, if there are any, those of the surface where they are stated.
std::vector<Vector3> all_places(const std::vector<Target>& targets, const TetMesh& mesh,
                                SurfaceErrors of_surface) {
    std::vector<Vector3> places;
    for (const Target& t : targets) places.insert(places.end(), t.places.begin(), t.places.end());
    if (targets.empty() || of_surface == SurfaceErrors::left_out) return places;
    const std::vector<Vector3> surface = surface_places(mesh);
    places.insert(places.end(), surface.begin(), surface.end());
    return places;
}

ErrorStatement::OnMesh on_mesh_of(const Scene& scene, MeshHierarchy hierarchy, const TetMesh& mesh,
                                  const std::vector<Vector3>& places) {
    return {TargetResponses(scene, std::move(hierarchy), places), PointSampler(mesh, places)};
}

}  // namespace

const char* name_of(ErrorSource source) {
    constexpr std::array<const char*, error_source_count> names{"reference", "fiducials", "sensors",
                                                                "patches",   "materials", "fixed",
                                                                "elements",  "law",       "solver"};
    return names[static_cast<std::size_t>(source)];
}

ErrorSources ErrorSources::of_bits(std::uint32_t bits) {
    ErrorSources sources;
    sources.bits_ = bits;
    return sources;
}

ErrorStatement::ErrorStatement(const Scene& scene, MeshHierarchy hierarchy, const TetMesh& mesh,
                               SurfaceErrors surface)
    : targets_(read_targets(scene, mesh)),
      on_mesh_(on_mesh_of(scene, std::move(hierarchy), mesh, all_places(targets_, mesh, surface))),
      has_forces_(scene.gravity_m_per_s2 != Vector3::Zero() || !scene.loads.empty() ||
                  !scene.drive.empty() || !scene.track->start.empty()) {
    statement_.targets.resize(targets_.size());
    std::size_t of_targets = 0;
    for (const Target& t : targets_) of_targets += t.places.size();
    statement_.surface.radius_95.resize(responses().places().size() - of_targets);
    missing_of_turn_.fill(ErrorSources::all());
}

void ErrorStatement::start(std::span<const SensorPatch* const> patches,
                           const std::vector<FixOptions>& fix) {
    std::vector<ResponsePatch> all;
    for (const SensorPatch* p : patches) all.push_back(response_patch(*p));
    terms_.assign(patches.size(), {});
    on_mesh_.responses.start(std::move(all), fix);
}

ErrorStatement::OnMesh ErrorStatement::on_mesh(const Scene& scene, MeshHierarchy hierarchy,
                                               const TetMesh& before, const TetMesh& after) const {
    return {responses().on_mesh(scene, std::move(hierarchy)),
            on_mesh_.sampler.after_cut(before, after)};
}

void ErrorStatement::set_mesh(OnMesh&& on_mesh) {
    on_mesh_ = std::move(on_mesh);
    missing_of_turn_.fill(ErrorSources::all());
}

void ErrorStatement::find_terms(const PoseErrors& poses,
                                std::span<const SensorPatch* const> patches) {
    for (std::size_t s = 0; s < patches.size(); ++s) {
        const SensorPatch& patch = *patches[s];
        PatchTerms& t = terms_[s];
        t.motion = patch.motion();
        t.error = patch.error();
        t.is_firm = patch.drive().grip() == 1;
        const Vector3& at = patch.drive().base()->translation;
        // the patch is put on the surface: what is off along the normal moves no patch
        const Matrix3d along = Matrix3d::Identity() - outer(patch.normal());
        Matrix3d off = by_registration(poses, at);
        if (t.error) off += t.error->base;
        t.place = outer(patch.off_centre()) + along * off * along;
        t.by_reference.setZero();
        t.base_by_reference.setZero();
        if (!t.error) continue;
        if (!poses.reference) continue;
        const Matrix36d J = by_reference(poses, at);
        const double whole = (J * poses.reference->covariance * J.transpose()).trace();
        if (whole > 0) t.by_reference = std::min(1.0, std::sqrt(t.error->by_reference / whole)) * J;
        // what the sensor's filter passes of the reference's noise, and the reference's does not
        double own = std::max(0.0, t.error->by_reference - whole);
        if (whole > 0) {
            t.base_by_reference = std::sqrt(t.error->base_by_reference / whole) * J;
            own -= t.error->base_by_reference;
        }
        t.error->own.topLeftCorner<3, 3>() += own / 3 * Matrix3d::Identity();
    }
}

void ErrorStatement::find_missing(const PoseErrors& poses, const SolveErrors& solve) {
    using enum ErrorSource;
    ErrorSources& missing = statement_.missing;
    missing = {};
    const auto add = [&](std::initializer_list<ErrorSource> sources) {
        for (const ErrorSource source : sources) missing.add(source);
    };
    if (!poses.reference) add({reference});
    if (!poses.registration || !poses.registration->holds_tip) add({fiducials});
    if (!poses.registration && !terms_.empty()) add({patches});  // where they are
    if (poses.is_unknown_elsewhere) add({sensors});
    for (const PatchTerms& t : terms_) {
        if (!t.error) add({sensors, patches});
        if (!t.is_firm)  // the responses' patches are
            add({patches, materials, fixed, elements, law});
    }
    if (!responses().are_known()) add({sensors, patches, materials, fixed, elements, law});
    if (!responses().knows_elements()) add({elements});
    if (responses().lacking().wider) add({patches});
    if (responses().lacking().materials) add({materials});
    if (responses().lacking().fixed) add({fixed});
    if (has_forces_) add({materials, fixed, elements, law});
    if (solve.has_turned_elements) add({elements, law});
    if (!solve.linear) add({solver});
    statement_.computed = responses().share_done();
}

const FrameStatement& ErrorStatement::update(const PoseErrors& poses,
                                             std::span<const SensorPatch* const> patches,
                                             std::span<const Vector3> displacement,
                                             const SolveErrors& solve) {
    find_terms(poses, patches);
    find_missing(poses, solve);
    const double solver_error = solve.linear.value_or(0);
    std::size_t place = 0;
    for (std::size_t t = 0; t < targets_.size(); ++t) {
        TargetStatement& worst = statement_.targets[t];
        for (std::size_t k = 0; k < targets_[t].places.size(); ++k, ++place) {
            const TargetStatement here =
                state(place, poses, on_mesh_.sampler.sample(place, displacement), solver_error);
            if (k == 0 || here.radius_95 > worst.radius_95) worst = here;
        }
    }
    renew_surface(poses, displacement, solver_error);
    return statement_;
}

void ErrorStatement::renew_surface(const PoseErrors& poses, std::span<const Vector3> displacement,
                                   double solver_error) {
    SurfaceStatement& surface = statement_.surface;
    const std::size_t first = responses().places().size() - surface.radius_95.size();
    for (std::size_t i = turn_; i < surface.radius_95.size(); i += surface_turns) {
        const Vector3 u = on_mesh_.sampler.sample(first + i, displacement);
        surface.radius_95[i] = state(first + i, poses, u, solver_error).radius_95;
    }
    missing_of_turn_[turn_] = statement_.missing;
    turn_ = (turn_ + 1) % surface_turns;
    surface.missing = {};
    for (const ErrorSources& missing : missing_of_turn_) surface.missing.add(missing);
}

TargetStatement ErrorStatement::state(std::size_t place, const PoseErrors& poses, const Vector3& u,
                                      double solver_error) const {
    const Vector3& x = responses().places()[place];
    ErrorSum sum;
    sum.add(ErrorSource::fiducials, by_registration(poses, x));
    sum.add(ErrorSource::solver, solver_error * solver_error / 3 * Matrix3d::Identity());
    const auto add_values = [&](ErrorSource source, auto PatchResponse::*changes) {
        const std::size_t count = terms_.empty() ? 0 : (responses().at(place, 0).*changes).size();
        for (std::size_t i = 0; i < count; ++i) {
            Vector3 change = Vector3::Zero();
            for (std::size_t s = 0; s < terms_.size(); ++s)
                change += (responses().at(place, s).*changes)[i] * terms_[s].motion;
            sum.add(source, outer(change));
        }
    };
    Matrix36d of_reference = Matrix36d::Zero(), of_bases = Matrix36d::Zero();
    if (poses.reference) of_reference = by_reference(poses, x);
    if (responses().are_known()) {
        Vector3 by_radii = Vector3::Zero(), by_elements = Vector3::Zero(), by_large_strain = u;
        for (std::size_t s = 0; s < terms_.size(); ++s) {
            const PatchTerms& t = terms_[s];
            const PatchResponse& r = responses().at(place, s);
            add_patch(sum, r, t.motion, t.error ? &*t.error : nullptr, t.place);
            of_reference -= r.motion.leftCols<3>() * t.by_reference;
            of_bases += r.motion.leftCols<3>() * t.base_by_reference;
            by_radii += r.wider * t.motion;
            by_elements += r.elements * t.motion;
            by_large_strain -= r.motion * t.motion;
        }
        sum.add(ErrorSource::patches, outer(by_radii));
        sum.add(ErrorSource::elements, outer(by_elements));
        sum.add(ErrorSource::law, outer(law_share * by_large_strain));
        add_values(ErrorSource::materials, &PatchResponse::materials);
        add_values(ErrorSource::fixed, &PatchResponse::fixed);
    }
    if (poses.reference)
        for (const Matrix36d& of : {of_reference, of_bases})
            sum.add(ErrorSource::reference, of * poses.reference->covariance * of.transpose());
    return sum.at(x + u);
}

}  // namespace livetet
