#pragma once

#include <string>

#include "base/child_process.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

struct GmshOptions {
    /// Time limit of all attempts together, seconds; then Gmsh's process is killed.
    double time_limit_s = 300;
    int optimise_passes = 2;           ///< passes of Gmsh's optimiser; 0: none
    EdgeLengthField edge_length_at{};  ///< inside; none: that of the nearby triangles
    /// Runs the work in a child process; tests substitute children that hang or crash.
    std::function<ChildResult(const std::function<int(int)>& work, double time_limit_s)> run =
        run_in_child;
};

/// Fills a closed surface with tets, but for its cavities (shells wound inwards within another).
/// Edges are as long as those of the nearby triangles at the surface and up to 1.5 times as long
/// inside. The triangles become the mesh's boundary unchanged.
///
/// Tries Gmsh's HXT first and then its Delaunay algorithm, in reverse order if inner edge lengths
/// are given, which HXT ignores (C. Geuzaine and J.-F. Remacle, Gmsh, 2009; C. Marot et al., One
/// machine, one minute, three billion tetrahedra, 2019). Runs in a child process, since Gmsh may
/// hang and ignore SIGTERM.
///
/// Tets are positively oriented; nodes and tets are in the order of `sort_for_locality`. `way`, if
/// given, receives the algorithm that succeeded and why earlier ones failed. Throws Error with
/// Gmsh's last error lines and the surface's bounding box if all fail or the time is up.
TetMesh fill_surface(const TriangleMesh& surface, double edge_length_m,
                     const GmshOptions& options = {}, std::string* way = nullptr);

/// Version of the Gmsh API used at compile time, for the provenance.
std::string gmsh_version();

}  // namespace livetet
