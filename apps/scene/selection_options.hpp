#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/fields.hpp"
#include "mesh/node_selection.hpp"

namespace livetet {

class KeyPlaces;

/// A selection of nodes by exactly one of mask, group, box, sphere, half-space, nodes. Coordinates
/// are those of the mesh, RAS.
struct SelectionOptions {
    std::optional<std::filesystem::path> mask;
    std::optional<std::string> group;
    std::optional<std::vector<double>> box_mm, sphere_mm, half_space_mm;
    std::optional<std::vector<int>> nodes;
    NodeScope where = NodeScope::all;

    bool operator==(const SelectionOptions&) const = default;
};

template <class Visitor>
void visit_selection(Visitor& v, SelectionOptions& s) {
    v.field("mask", s.mask, "",
            "nodes in the non-zero voxels of this mask image (NIfTI, NRRD, MetaImage, DICOM)");
    v.field("group", s.group, "",
            "nodes of this named set: a Gmsh physical group, or one kept in the hierarchy file");
    v.field("box_mm", s.box_mm, "mm", "nodes in the box [x0, y0, z0, x1, y1, z1]");
    v.field("sphere_mm", s.sphere_mm, "mm", "nodes in the sphere [x, y, z, radius]");
    v.field("half_space_mm", s.half_space_mm, "mm",
            "nodes on the side of a plane that its normal points away from: [point x, y, z, normal "
            "x, y, z]");
    v.field(
        "nodes", s.nodes, "",
        "these nodes of a hierarchy (.h5), counted from 0 in its file; the nodes of other files "
        "are numbered anew as they are read");
    v.choice("where", s.where, "which of those nodes",
             {{NodeScope::all, "all", "inside and surface"},
              {NodeScope::surface_only, "surface",
               "only those on the surface, which the walls of cuts are no part of"}});
}

/// How many of its keys are given.
int selections_in(const SelectionOptions& s);

/// Throws Error unless one key of a selection is given, with as many numbers as it takes. `key`: of
/// the table.
void check_selection(const SelectionOptions& s, const std::string& key, const KeyPlaces& places);

}  // namespace livetet
