#pragma once

#include <vector>

#include "apps/scene/selection_options.hpp"
#include "apps/scene/track_options.hpp"
#include "config/fields.hpp"

namespace livetet {

class KeyPlaces;

/// How forces vary over a zone of the boundary.
enum class ForcePattern { uniform, smooth };

/// A part of the boundary on which unknown forces act.
struct ForceZoneOptions : SelectionOptions {
    ForcePattern pattern = ForcePattern::smooth;
    int centres = 6;
};

/// What is sought of the frame that the points are given in.
enum class PointFrame { fixed, refined, surface };

/// How `livetet register --deform` finds forces and displacement from points of the surface.
struct DeformOptions {
    std::vector<ForceZoneOptions> forces;
    double point_error_mm = 1;
    double landmark_error_mm = 2;
    double shared_error_mm = 10;
    double model_error_percent = 15;
    NumberOrAuto energy_mJ{};
    PointFrame frame = PointFrame::refined;
    double frame_error_mm = 3;
    double frame_error_deg = 2;
    double tolerance_mm = 0.5;
    int max_iterations = 40;
    int later_iterations = 1000;
    std::vector<TargetOptions> targets;
    std::string surface_points;  ///< a file or a stream
    std::vector<std::string> later_points;
    std::filesystem::path landmarks, landmarks_at_rest;
};

template <class Visitor>
void visit_fields(Visitor& v, ForceZoneOptions& z) {
    v.choice("pattern", z.pattern, "how the forces vary over the zone",
             {{ForcePattern::uniform, "uniform",
               "the same force at each node: three unknowns, for a zone that is pulled or pushed "
               "as a whole"},
              {ForcePattern::smooth, "smooth",
               "about `centres` places that are spread over the zone: three unknowns each"}});
    v.field("centres", z.centres, "", "smooth: number of those places", within<int>({1, 100}));
    visit_selection(v, z);
}

template <class Visitor>
void visit_fields(Visitor& v, DeformOptions& d) {
    v.list(
        "forces", d.forces,
        "the parts of the surface on which forces may act that deform the organ; none: on all "
        "of it, smooth, with 20 centres. Nodes inside, and those that `fix` holds, are left out");
    v.field("point_error_mm", d.point_error_mm, "mm",
            "error of a surface point along the normal, of the model's surface, too: one standard "
            "deviation",
            within({0.01, 20}));
    v.field("landmark_error_mm", d.landmark_error_mm, "mm",
            "error of a landmark along each axis, one standard deviation", within({0.01, 50}));
    v.field("shared_error_mm", d.shared_error_mm, "mm",
            "points nearer to each other than about this share one error, that of the model: many "
            "points on one spot say no more than a few; 0: each has its own",
            within({0, 100}));
    v.field("model_error_percent", d.model_error_percent, "%",
            "error of the model inside, for another material, other constraints and its mesh: of a "
            "target's displacement, along each axis, one standard deviation. It enters the stated "
            "error alone",
            within({0, 100}));
    v.field("energy_mJ", d.energy_mJ, "mJ",
            "elastic energy of forces that need no reason in the points: smaller is stiffer. auto: "
            "the value that makes the points most probable, chosen with the deformation",
            within<NumberOrAuto>({.low = 0, .ends = Ends::low_excluded}, ", or auto"));
    v.choice("frame", d.frame, "what is sought of the frame of the points",
             {{PointFrame::fixed, "fixed", "nothing: it is the mesh's"},
              {PointFrame::refined, "refined",
               "a rigid motion about where the points are given, within frame_error_mm and "
               "frame_error_deg, together with the deformation"},
              {PointFrame::surface, "surface",
               "the same about where the points fit the surface at rest best: for a frame that is "
               "known only roughly"}});
    v.field("frame_error_mm", d.frame_error_mm, "mm",
            "what the centre of the points may be off by along each axis, one standard deviation",
            within({0.01, 200}));
    v.field("frame_error_deg", d.frame_error_deg, "degrees",
            "what the points may be turned by about each axis, one standard deviation",
            within({0.01, 45}));
    v.field("tolerance_mm", d.tolerance_mm, "mm",
            "ends when no node and no point moves farther from there, by how the last steps fell "
            "off",
            within({0.001, 10}));
    v.field("max_iterations", d.max_iterations, "", "Gauss-Newton iterations at most",
            within<int>({1, 1000}));
    v.field("later_iterations", d.later_iterations, "",
            "iterations at most for each list of later_points: what is left then is done with the "
            "next list, and the frame states no error; the last list goes on to its end",
            within<int>({1, 1000}));
    v.list("targets", d.targets,
           "where the error of the result is stated: each by point_mm, points, or a selection of "
           "nodes (of a region, the worst place counts); none: those of track.targets");
    v.field("surface_points", d.surface_points, "",
            "what --surface-points names, where it is not given: points of the deformed surface, a "
            "list, a recording or a stream");
    v.field("later_points", d.later_points, "",
            "what --later-points names, where it is not given: lists of points of the surface as "
            "the organ moves on");
    v.field("landmarks", d.landmarks, "",
            "what --landmarks names, where it is not given: a list of named points of the deformed "
            "organ");
    v.field("landmarks_at_rest", d.landmarks_at_rest, "", "the same points at rest: --image");
}

/// Checks keys of a deform section against each other. Throws Error with the place of a key.
void check_deform(const DeformOptions& deform, const KeyPlaces& places);

}  // namespace livetet
