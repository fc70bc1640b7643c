#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/registration_cases.hpp"
#include "apps/scene/body_factory.hpp"

namespace livetet {

/// What the model's scene says of what holds the organ.
enum class KnownSupport {
    fixed,  ///< the nodes that are held are known
    soft    ///< springs on all of the lower side
};
/// And of where forces act.
enum class KnownForces {
    zone,       ///< within 30 mm of a place that is 5 mm from the true one
    wide_zone,  ///< within 40 mm of one that is 10 mm from it
    nowhere     ///< not stated: on all of the surface
};

/// Conditions of a registration.
struct RegistrationCell {
    const char* varied = "";  ///< which of them is not that of the first cell
    double rms_m = 0.015;     ///< motion of the targets
    SurfaceSweep sweep{};
    KnownSupport support = KnownSupport::fixed;
    KnownForces forces = KnownForces::zone;
    const char* law = "neohookean";  ///< of the model
};

/// Keys of the scene's section deform that a user of the benchmark may vary.
struct RegistrationPrior {
    std::optional<double> energy_mJ{};  ///< none: auto
    double shared_error_mm = DeformOptions{}.shared_error_mm;
    double model_error_percent = DeformOptions{}.model_error_percent;
};

/// A target, registered; m, in the image.
struct RegisteredTarget {
    Vector3 motion;            ///< true
    Vector3 rigid, deforming;  ///< errors
    double radius_95 = 0;      ///< stated for `deforming`; 0: none
    bool within = false;       ///< the error is within the stated 95 % ellipsoid
};

/// A registration of one seed in a cell.
struct RegistrationRun {
    std::vector<RegisteredTarget> targets;
    double largest_m = 0;  ///< motion of a node of the truth
    bool converged = false;
    bool is_stated = false;
    std::size_t directions = 0, open_directions = 0;  ///< of the forces; open: left to the prior
    const char* reason = "";                          ///< why it ended
    int iterations = 0;
    double energy_mJ = 0;           ///< of the prior, as chosen or stated
    double first_s = 0, fit_s = 0;  ///< processor time to the first iteration's end, and of all
    std::string refusal;  ///< what the registration was refused for; then the rigid one counts
};

/// RMS of a vector of the targets of all runs, m.
double rms_over(const std::vector<RegistrationRun>& runs, Vector3 RegisteredTarget::*vector);

/// Registers the organ by its surface, rigidly and deforming, with a model of another material (nu
/// = 0.40 in place of 0.45), mesh and elements (four nodes) than the truth's. The frame of the
/// points is off by 2 mm and 1 degree. `model`: the mesh, with the set "fixed". `prior`: values of
/// the scene's section deform. Needs a PetscSession.
RegistrationRun run_registration(const RegistrationCell& cell, const PulledOrgan& organ,
                                 const MeshHierarchy& model, std::uint64_t seed,
                                 const RegistrationPrior& prior);

}  // namespace livetet
