#pragma once

#include <string>

#include "base/child_process.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

struct GmshOptions {
    double time_limit_s = 300;  ///< seconds, for all tries together; then Gmsh's process is killed
    int optimise_passes = 2;    ///< passes of Gmsh's optimiser; 0: none
    EdgeLengthField edge_length_at{};  ///< inside; none: that of the triangles near it
    /// How the work is run apart from this process; tests put a hanging or a crashing child here.
    std::function<ChildResult(const std::function<int(int)>& work, double time_limit_s)> run =
        run_in_child;
};

/// Fills a closed surface with tets of the size of its triangles near it, with edges up to half as
/// long again inside. The triangles stay as they are: they are the mesh's boundary. Gmsh's HXT is
/// tried first, then its Delaunay algorithm, the other way round where edge lengths are given for
/// the inside, which HXT does not heed (C. Geuzaine and J.-F. Remacle, Gmsh, 2009; C. Marot et al.,
/// One machine, one minute, three billion tetrahedra, 2019), in a child process, since Gmsh can
/// hang for ever, deaf to SIGTERM. Tets are positively oriented; nodes and tets are in the order of
/// `sort_for_locality`. `way`, if given, gets the algorithm that succeeded and why those before it
/// did not. Throws Error with Gmsh's last words and the surface's box where it fails, or at the
/// time limit.
TetMesh fill_surface(const TriangleMesh& surface, double edge_length_m,
                     const GmshOptions& options = {}, std::string* way = nullptr);

/// The version of the Gmsh API that this is compiled against, for provenance.
std::string gmsh_version();

}  // namespace livetet
