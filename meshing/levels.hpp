#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"
#include "meshing/gmsh_volume.hpp"
#include "meshing/label_field.hpp"
#include "meshing/optimise.hpp"
#include "meshing/options.hpp"
#include "meshing/quality.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_distance.hpp"

namespace livetet {

/// How one level was made.
struct LevelReport {
    /// Edge length requested: from the options, or found for the requested number of tets.
    double requested_edge_length_m = 0;
    double edge_length_m =
        0;  ///< edge length that worked; smaller if the requested one was too coarse
    /// Gmsh's algorithm and why earlier ones failed; or CGAL, from the labels.
    std::string filled_by;
    OptimiseReport optimise;
    MeshQuality quality;
    HausdorffDistance distance;  ///< between the level's boundary and the (repaired) input surface
    ShellCount shells;           ///< parts and cavities that the level has
    double volume_ratio = 1;     ///< volume of the level divided by that of the body
    std::vector<std::string> dropped;  ///< rejected attempts with their reasons, a line each
    int fillings = 0;                  ///< volumes meshed, including rejected ones
    double seconds = 0;                ///< wall time
};

/// A level could not be made. The message says what is wrong and where (the position, or the body's
/// bounding box if it is unknown). `surface` is the last one tried, for inspection.
class MeshingFailure : public Error {
  public:
    MeshingFailure(const std::string& message, TriangleMesh tried)
        : Error(message), surface(std::move(tried)) {}
    TriangleMesh surface;
};

/// A hierarchy and how its levels were made.
struct HierarchyResult {
    MeshHierarchy hierarchy;
    std::vector<LevelReport> levels;  ///< one for each level
    /// Deviations from the request, a line each, for the user.
    std::vector<std::string> notes;
    /// The materials of a body with several; regions are their labels.
    std::vector<LabelField::Material> materials;
};

/// The labels that a surface was cut from, which allow meshing without Gmsh. `field` is called when
/// it is first needed.
struct Materials {
    bool several = false;  ///< more than one label; the levels keep their interfaces
    std::function<LabelField()> field;
    /// Target volume of the levels, that of the voxels; none: that of the surface.
    std::optional<double> volume_m3{};
};

/// Builds a hierarchy of non-nested levels. The surface is repaired (changes are noted) and reduced
/// to `options.body`. Cavities and parts become sets of every level (see `name_shells`); the finest
/// level has all of them, a note says where a coarser one has not. Then, for
/// every level, it is remeshed at that level's edge length and filled, and the tets are improved
/// until no dihedral angle is below `options.min_dihedral_deg`; if that fails, other edge lengths
/// are tried.
///
/// The finest level's edge length h is found from `options.target_tets` unless lengths are given
/// (tets = c V / h^3, with c from the last attempt). It keeps the body's volume to 1 %; a note
/// reports a coarser level that misses it by more than 10 %. Coarser levels are remeshed from the
/// finest one's surface. A coarser level that cannot be made, or is not coarser than the one before
/// it, ends the hierarchy with a note.
///
/// With several `materials`, `fill_labels` makes every level, `keep_region_volumes` restores the
/// regions' volumes as far as the angles allow, and regions that stay too small are noted. With one
/// material, `fill_labels` makes a level whose surface fails twice or takes more than 20 s, with a
/// note.
///
/// Remeshing and filling run in child processes that are killed at the time limit. `gmsh` lets
/// tests replace the way Gmsh is run; its time limit and passes come from `options`. Throws
/// MeshingFailure if the finest level cannot be made, and Error as `repair_surface` does.
HierarchyResult build_hierarchy(const TriangleMesh& surface, const MeshingOptions& options,
                                const ProgressCallback& progress = {}, const GmshOptions& gmsh = {},
                                const Materials& materials = {});

/// A table that says for each level how it was made and how far it is from the surface (mm, %, s).
/// `first`: number of the finest level. Every line ends with a line break.
std::string level_table(std::span<const LevelReport> levels, std::size_t first = 0);

}  // namespace livetet
