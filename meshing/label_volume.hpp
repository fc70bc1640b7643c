#pragma once

#include "base/child_process.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/label_field.hpp"
#include "meshing/options.hpp"

namespace livetet {

struct LabelVolumeOptions {
    double time_limit_s = 300;  ///< seconds; then the process that meshes is killed
    double inside_growth =
        default_inside_growth;     ///< edges deep inside over those of the interfaces
    double min_dihedral_deg = 10;  ///< aimed at
    EdgeLengthField shorter_at{};  ///< where edges are shorter than elsewhere; none: nowhere
    /// How the work is run apart from this process; tests put a hanging or a crashing child here.
    std::function<ChildResult(const std::function<int(int)>& work, double time_limit_s)> run =
        run_in_child;
};

/// Tets of all materials of a field at once, which share the triangles of their interfaces:
/// Delaunay refinement of interfaces and volumes (S. Oudot, L. Rineau, M. Yvinec, Meshing volumes
/// bounded by smooth surfaces, 2005; J.-P. Pons et al., High-quality consistent meshing of
/// multi-label datasets, 2007) as CGAL's Mesh_3 has it, in a child process. Regions are the labels.
/// Edges at the interfaces are about `edge_length_m` long, shorter where interfaces bend. The body
/// is one piece whose boundary is closed and manifold: what hangs together by nodes or edges only
/// is cut or filled, on the smaller side. Pieces of a label smaller than an eighth of a cubed edge
/// may be missing. Tets are positively oriented; they may be flat. Throws Error, with the labels'
/// box, where CGAL fails, or at the time limit.
TetMesh fill_labels(const LabelField& field, double edge_length_m,
                    const LabelVolumeOptions& options = {});

/// The version of CGAL that this is compiled against, for provenance.
std::string cgal_version();

}  // namespace livetet
