#pragma once

#include "base/child_process.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/label_field.hpp"
#include "meshing/options.hpp"

namespace livetet {

struct LabelVolumeOptions {
    double time_limit_s = 300;  ///< seconds; then the meshing process is killed
    double inside_growth =
        default_inside_growth;     ///< ratio of edges deep inside to those at the interfaces
    double min_dihedral_deg = 10;  ///< target, degrees
    EdgeLengthField shorter_at{};  ///< where edges are shorter; none: nowhere
    /// Runs the work in a child process; tests substitute children that hang or crash.
    std::function<ChildResult(const std::function<int(int)>& work, double time_limit_s)> run =
        run_in_child;
};

/// Meshes all materials of a field together, with shared interface triangles: Delaunay refinement
/// of interfaces and volumes by CGAL's Mesh_3 in a child process (S. Oudot, L. Rineau, M. Yvinec,
/// Meshing volumes bounded by smooth surfaces, 2005; J.-P. Pons et al., High-quality consistent
/// meshing of multi-label datasets, 2007). Regions are the labels. Edges at the interfaces are
/// about `edge_length_m` long, shorter at high curvature.
///
/// The body is connected, with a closed manifold boundary: parts connected only by nodes or edges
/// are cut off or joined, on the smaller side. Pieces of a label smaller than edge^3 / 8 may be
/// missing. Tets are positively oriented but may be flat. Throws Error, with the labels' bounding
/// box, if CGAL fails or the time is up.
TetMesh fill_labels(const LabelField& field, double edge_length_m,
                    const LabelVolumeOptions& options = {});

/// Version of CGAL used at compile time, for the provenance.
std::string cgal_version();

}  // namespace livetet
