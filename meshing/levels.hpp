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
#include "meshing/surface_distance.hpp"

namespace livetet {

/// How one level came to be.
struct LevelReport {
    double asked_edge_length_m =
        0;                     ///< the options', or the one found for the number of tets asked for
    double edge_length_m = 0;  ///< with which it worked: smaller where the asked one was too coarse
    std::string
        filled_by;  ///< Gmsh's algorithm, and why those before it failed; or CGAL, from the labels
    OptimiseReport optimise;
    MeshQuality quality;
    HausdorffDistance distance;  ///< between the level's boundary and the surface given (repaired)
    double volume_ratio = 1;     ///< of the level over that of the body
    std::vector<std::string> dropped;  ///< tries that were not taken, and why: a line each
    int fillings = 0;                  ///< volumes meshed in all, those not taken among them
    double seconds = 0;                ///< wall time
};

/// A level could not be made. `surface` is the last one tried, for a look; the message says what is
/// wrong and where: the place, or where it is not known the body's box.
class MeshingFailure : public Error {
  public:
    MeshingFailure(const std::string& message, TriangleMesh tried)
        : Error(message), surface(std::move(tried)) {}
    TriangleMesh surface;
};

struct HierarchyResult {
    MeshHierarchy hierarchy;
    std::vector<LevelReport> levels;  ///< one each
    std::vector<std::string>
        notes;  ///< what came out otherwise than asked: a line each, for the user
    std::vector<LabelField::Material>
        materials;  ///< of the body, where it has several; regions are their labels
};

/// The labels that a surface was cut from: a second way to tets. `field` is asked for once it is
/// needed.
struct Materials {
    bool several = false;  ///< of more than one label, whose interfaces the levels have to keep
    std::function<LabelField()> field;
    std::optional<double>
        volume_m3{};  ///< of their voxels, which the levels are held to; none: the surface's
};

/// A hierarchy of non-nested levels: the surface is repaired (what that changes is noted), then for
/// every level remeshed at that level's own edge length, filled, and improved until no dihedral
/// angle is below `options.min_dihedral_deg`; where that does not come about, other edges are
/// tried. The finest level's edge length is found from `options.target_tets` where no lengths are
/// given (tets = c V / h^3, c from the last try) and holds the body's volume to 1 %; where a
/// coarser one misses it by more than a tenth, a note says so. Coarser levels are remeshed from the
/// finest one's surface. A coarser level that cannot be made, or would not be coarser than the one
/// before it, ends the hierarchy, with a note. `materials`: with several, every level is made by
/// `fill_labels`, its regions get their voxels' volumes as far as the angles let them
/// (`keep_region_volumes`), and what of them is too small is noted; with one, a level whose surface
/// fails twice, or for more than 20 s, is made that way, with a note. Surfaces are remeshed, and
/// volumes filled, in child processes that are killed at the time limit. `gmsh` lets tests replace
/// how Gmsh is run; its time limit and passes come from `options`. Throws MeshingFailure where the
/// finest level cannot be made, Error as repair_surface does.
HierarchyResult build_hierarchy(const TriangleMesh& surface, const MeshingOptions& options,
                                const ProgressCallback& progress = {}, const GmshOptions& gmsh = {},
                                const Materials& materials = {});

/// How each level, of which `first` is the number of the finest, relates to the surface and how it
/// was made: a table in mm, %, s; every line ends with a line break.
std::string level_table(std::span<const LevelReport> levels, std::size_t first = 0);

}  // namespace livetet
