#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/fields.hpp"
#include "io/surface_file.hpp"
#include "meshing/options.hpp"

namespace livetet {

enum class LengthUnit { millimetre, metre };

/// Where a mesh that is made from an image or a surface has shorter edges.
enum class MeshGrading { even, scene };

/// What a mesh that is made from an image consists of.
enum class MeshCells { tetrahedra, hexahedra };

/// The mesh section of a scene: where the mesh comes from, and how it is made.
struct MeshSource {
    std::filesystem::path file;
    LengthUnit unit = LengthUnit::millimetre;
    Space space = Space::ras;
    MeshCells cells = MeshCells::tetrahedra;
    std::vector<int> labels;
    std::string threshold{};
    BodyChoice body{};
    std::optional<double> wrap_mm{};
    std::optional<double> voxel_mm{}, smoothing_mm{};
    std::vector<double> edge_lengths_mm;
    int tets = 60000;
    int levels = 0;
    int refine = 0;
    MeshGrading grading = MeshGrading::even;
};

/// Parses a closed range of values such as "100:300", "100:" or ":300". Empty if it is invalid.
std::optional<std::pair<double, double>> range_of(const std::string& text);

template <class Visitor>
void visit_fields(Visitor& v, MeshSource& m) {
    v.field(
        "file", m.file, "",
        "a hierarchy (.h5 of `livetet mesh`), a mesh (.msh, .vtu, .vtk), an image (.nii, .nii.gz, "
        ".nrrd, .nhdr, .mha, .mhd; DICOM: a file or a folder), "
        "or a surface (.stl, .obj, .ply, .vtk, .vtp, .off)");
    v.choice("unit", m.unit, "length unit of a surface, .msh or .vtu file",
             {{LengthUnit::millimetre, "mm", "millimetres"}, {LengthUnit::metre, "m", "metres"}});
    v.choice(
        "space", m.space,
        "directions of the axes of a surface, .msh or .vtu file, which the file does not state",
        {{Space::ras, "ras", "right, anterior, superior"},
         {Space::lps, "lps", "left, posterior, superior, as in models of 3D Slicer since 2020"}});
    v.choice("cells", m.cells, "what an image is meshed by",
             {{MeshCells::tetrahedra, "tetrahedra", "tetrahedra that follow its smoothed surface"},
              {MeshCells::hexahedra, "hexahedra",
               "a grid of its voxels, or of 8, 64, ... of them, those at the border weighted by "
               "their share of the body: any label map; for `solve`, `study` and `track`"}});
    v.field("labels", m.labels, "",
            "labels of the label map that make up the body; empty: all but 0");
    v.field(
        "threshold", m.threshold, "",
        "the body in a grey image: the voxels with values from LOW to HIGH, in its units, such as "
        "\"100:300\", \"100:\" or \":300\"",
        Check<std::string>{
            "LOW:HIGH, two numbers of which one may be left out, LOW not above HIGH",
            [](const std::string& text) { return text.empty() || range_of(text).has_value(); }});
    v.choice("cavities", m.body.cavities, "closed cavities of an image's or a surface's body",
             {{Cavities::keep, "keep", "kept: the set \"cavity\" is their surface"},
              {Cavities::fill, "fill", "filled"}});
    v.choice("parts", m.body.parts, "parts of an image's or a surface's body that do not touch",
             {{Parts::largest, "largest", "the largest is meshed"},
              {Parts::all, "all", "all are meshed: the sets \"part_1\", \"part_2\", ..."}});
    v.field("speck_ml", m.body.speck_ml, "ml",
            "smaller parts are left out and smaller cavities filled; default: a thousandth of the "
            "largest part",
            at_least<0>());
    v.field("wrap_mm", m.wrap_mm, "mm",
            "wraps an open, crossing or dirty surface by a closed one: gaps narrower than this are "
            "closed; default: the surface is taken as it is",
            greater_than<0>());
    v.field("voxel_mm", m.voxel_mm, "mm",
            "spacing of the grid from which an image's surface is extracted; default: from the "
            "size of the body and its voxels",
            greater_than<0>());
    v.field("smoothing_mm", m.smoothing_mm, "mm",
            "standard deviation of the Gaussian that smooths an image's voxels, at least 0.6 "
            "voxels; default: as voxel_mm, or less if a thin body would lose volume",
            greater_than<0>());
    v.field("edge_lengths_mm", m.edge_lengths_mm, "mm",
            "edge length of each level, finest first; empty: from tets and levels");
    v.field("tets", m.tets, "",
            "approximate number of tetrahedra of the finest level; of hexahedra the largest number",
            within<int>({min_tets, max_tets}));
    v.field("levels", m.levels, "",
            "number of levels; 0: as many as bring the coarsest to about 150 tets, but one for a "
            ".msh or .vtu",
            within<int>({0, max_levels}));
    v.field("refine", m.refine, "",
            "number of uniform refinements, each tet into eight and each a level more: for meshes "
            "larger than a mesher can write",
            within<int>({0, 4}));
    v.choice(
        "grading", m.grading,
        "where edges are shorter, at the same number of tetrahedra; with edge_lengths_mm their "
        "number grows",
        {{MeshGrading::even, "even", "nowhere"},
         {MeshGrading::scene, "scene",
          "at the planned patches of sensors (track.sensors: place_mm) and at driven spheres "
          "(drive: sphere_mm)"}});
}

}  // namespace livetet
