#pragma once

#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// How the stability cases' body moves: what drives its patch, and by how much.
enum class PatchMotion { none, press, deep_press, jump, turn, through, noise };
enum class StartState { rest, flat, everted, random };
enum class HeldBy { face, line, node };

/// One trial of stability: a box of 0.2 x 0.1 x 0.1 m, held where x = 0, whose patch is driven,
/// held still and let go. What a case does not name is a trial that anything should stand: tissue,
/// pressed by 20 mm in ten steps.
struct StabilityCase {
    std::string group, value;  ///< what is extreme about it: "poisson", "0.4999"
    double young_Pa = 3000, poisson = 0.45, density_kg_per_m3 = 1000;
    double contrast = 1;    ///< of Young's modulus: the upper half's to the lower's
    double edge_ratio = 1;  ///< the uppermost layer of tets is thinner than the others by this
    double min_dihedral_deg = 0;  ///< inner tets are flattened to this angle; 0: as they are
    double step_s = 0.02;
    PatchMotion motion = PatchMotion::press;
    StartState start = StartState::rest;
    HeldBy held = HeldBy::face;
    double cut_share = 0;  ///< of the height, from below, that is cut in the middle of the length
    /// Of many ten-node tets. Such a case is tried as a static `solve` alone: any other column
    /// would take hours.
    bool is_fine = false;

    /// Whether it is about tets: their shape or number.
    bool is_of_tets() const { return is_fine || edge_ratio != 1 || min_dihedral_deg != 0; }
    /// The steps in which the patch is driven.
    int driven_steps(int noise_frames) const;
    /// First bending period of the softer half as a clamped beam, s.
    double period_s() const;
};

std::vector<StabilityCase> stability_cases();

/// The case's box on two levels, `cells` along its height on the finer one, with its cut. Throws
/// Error where the tets cannot be made as flat as asked.
MeshHierarchy stability_mesh(const StabilityCase& c, int cells);

/// The case's box as a grid of hexahedra, `cells` along its height, with its cut. The case is not
/// one of tets.
MeshHierarchy stability_grid(const StabilityCase& c, int cells);

/// Materials and fixed nodes of a case as a scene's, of one constitutive model, for one of the
/// schemes.
Scene stability_scene(const StabilityCase& c, const ModelChoice& strain, TimeScheme scheme,
                      const TetMesh& mesh);

/// Nodes of the driven patch.
std::vector<std::int32_t> stability_patch(const StabilityCase& c, const TetMesh& mesh);

/// Where a node of the patch has come to in step `k` (from 1) of so many, m from its place at rest
/// `x`.
Vector3 patch_displacement(const StabilityCase& c, const Vector3& x, int k, int steps);

/// Each node's displacement at the start.
std::vector<Vector3> start_displacement(StartState start, const TetMesh& mesh);

}  // namespace livetet
