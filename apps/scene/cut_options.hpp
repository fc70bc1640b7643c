#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/fields.hpp"
#include "io/surface_file.hpp"

namespace livetet {

class KeyPlaces;

/// What becomes of pieces that cuts leave without any constraint.
enum class FreePieces { refuse, leave_out, keep };

/// A cut: a plane or a patch of it, or a surface. Coordinates are those of the mesh, RAS.
struct CutOptions {
    std::optional<Eigen::Vector3d> point_mm, normal;
    std::optional<double> radius_mm;
    std::optional<std::vector<double>> edges_mm;
    std::filesystem::path file;
    Space space = Space::ras;
};

template <class Visitor>
void visit_fields(Visitor& v, CutOptions& c) {
    v.field("point_mm", c.point_mm, "mm",
            "a point of the cutting plane, the middle of its disc or rectangle");
    v.field("normal", c.normal, "", "the plane's normal, of any length but zero");
    v.field("radius_mm", c.radius_mm, "mm",
            "the plane cuts within this distance of point_mm only; none: everywhere",
            greater_than<0>());
    v.field("edges_mm", c.edges_mm, "mm",
            "two edges [x, y, z, x, y, z] of a rectangle or parallelogram with its middle at "
            "point_mm; only it cuts; in place of normal");
    v.field("file", c.file, "",
            "a surface (.stl, .obj, .ply, .vtk, .vtp, .off) in mm that cuts in place of a plane; "
            "it may be open");
    v.choice(
        "space", c.space, "directions of the axes of that file, which it does not state",
        {{Space::ras, "ras", "right, anterior, superior"},
         {Space::lps, "lps", "left, posterior, superior, as in models of 3D Slicer since 2020"}});
}

/// Throws Error unless a cut is either a file or a plane with a point and either a nonzero normal
/// or two edges that span an area. `key`: of its table.
void check_cut(const CutOptions& cut, const std::string& key, const KeyPlaces& places);

}  // namespace livetet
