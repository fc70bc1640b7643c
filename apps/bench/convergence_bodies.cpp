#include "apps/bench/convergence_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/phantom/phantom_shape.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"

namespace livetet {

namespace {

struct Capsule {
    Vector3 from, to;
    double radius;
};

/// Adds a branch and, up to the last generation, the two that leave its end at 35 degrees to both
/// sides. `side`: unit normal to `direction`; it turns by a right angle from one generation to the
/// next.
void grow(std::vector<Capsule>& tree, const Vector3& from, const Vector3& direction,
          const Vector3& side, int generation) {
    constexpr int generations = 4;
    constexpr double angle = 35 * std::numbers::pi / 180;
    const double along = static_cast<double>(generation) / (generations - 1);
    const double radius = 0.006 * std::pow(2.0 / 6, along),
                 length = 0.040 * std::pow(15.0 / 40, along);
    const Vector3 to = from + length * direction;
    tree.push_back({from, to, radius});
    if (generation + 1 == generations) return;
    for (const double sign : {-1., 1.})
        grow(tree, to, std::cos(angle) * direction + sign * std::sin(angle) * side,
             direction.cross(side), generation + 1);
}

bool in_tree(const Vector3& x) {
    static const std::vector<Capsule> tree = [] {
        std::vector<Capsule> all;
        grow(all, Vector3::Zero(), Vector3::UnitZ(), Vector3::UnitX(), 0);
        return all;
    }();
    return std::any_of(tree.begin(), tree.end(), [&](const Capsule& c) {
        const Vector3 axis = c.to - c.from;
        const double along = std::clamp((x - c.from).dot(axis) / axis.squaredNorm(), 0., 1.);
        return (x - c.from - along * axis).norm() < c.radius;
    });
}

/// 4 mm thick, on 120 degrees of a cylinder of 130 mm about the z axis, 200 mm long.
bool in_wall(const Vector3& x) {
    return std::abs(std::hypot(x.x(), x.y()) - 0.130) < 0.002 && x.z() > 0 && x.z() < 0.2 &&
           std::abs(std::atan2(x.x(), x.y())) < std::numbers::pi / 3;
}

/// 120 x 80 x 20 mm, with four holes through it of 16 mm and one of 40 mm.
bool in_part(const Vector3& x) {
    const auto in_hole = [&](double px, double py, double radius) {
        return std::hypot(x.x() - px, x.y() - py) < radius;
    };
    if (x.minCoeff() < 0 || x.x() > 0.12 || x.y() > 0.08 || x.z() > 0.02) return false;
    for (const double px : {0.018, 0.102})
        for (const double py : {0.018, 0.062})
            if (in_hole(px, py, 0.008)) return false;
    return !in_hole(0.06, 0.04, 0.02);
}

ConvergenceBody organ() {
    const Vector3 centre = phantom::organ_centre(), half = phantom::organ_half_extents();
    const Vector3 pressed = 1e3 * phantom::sensor_place();
    return {"organ",
            [](const Vector3& x) { return phantom::organ_distance(x) < 0; },
            centre - half,
            centre + half,
            0.002,
            fmt::format("fix: [{{half_space_mm: [0, 0, -52, 0, 0, 1]}}]\n"
                        "drive: [{{box_mm: [{}, {}, {}, {}, {}, {}], displacement_mm: [0, 0, "
                        "-5]}}]\n",
                        pressed.x() - 12, pressed.y() - 12, pressed.z() - 8, pressed.x() + 12,
                        pressed.y() + 12, pressed.z() + 8)};
}

LabelImage labels_of(const ConvergenceBody& body) {
    constexpr int margin = 3;  // voxels
    LabelImage image;
    for (int c = 0; c < 3; ++c) {
        image.size[c] =
            static_cast<int>(std::ceil((body.high[c] - body.low[c]) / body.voxel_m)) + 2 * margin;
        image.ras_from_voxel(c, c) = body.voxel_m;
        image.ras_from_voxel(c, 3) = body.low[c] + (0.5 - margin) * body.voxel_m;
    }
    const Vector3 corner = image.ras_from_voxel.block<3, 1>(0, 3);
    for (int k = 0; k < image.size[2]; ++k)
        for (int j = 0; j < image.size[1]; ++j)
            for (int i = 0; i < image.size[0]; ++i)
                image.values.push_back(body.contains(corner + body.voxel_m * Vector3(i, j, k)) ? 1
                                                                                               : 0);
    return image;
}

}  // namespace

const std::vector<ConvergenceBody>& convergence_bodies() {
    static const std::vector<ConvergenceBody> all{
        organ(),
        {"vessel tree",
         in_tree,
         {-0.06, -0.06, -0.006},
         {0.06, 0.06, 0.12},
         0.001,
         "fix: [{half_space_mm: [0, 0, 0, 0, 0, 1]}]\ngravity_m_per_s2: [9.81, 0, 0]\n"},
        {"curved wall",
         in_wall,
         {-0.116, 0.06, 0},
         {0.116, 0.134, 0.2},
         0.0015,
         "fix: [{half_space_mm: [0, 0, 4, 0, 0, 1]}]\ngravity_m_per_s2: [0, -9.81, 0]\n"},
        {"part with holes",
         in_part,
         {0, 0, 0},
         {0.12, 0.08, 0.02},
         0.001,
         "fix: [{half_space_mm: [2, 0, 0, 1, 0, 0]}]\ngravity_m_per_s2: [0, 0, -9.81]\n"},
    };
    return all;
}

MeshHierarchy mesh_body(const ConvergenceBody& body, double nodes) {
    constexpr double tets_per_node = 4.5;  // less where a body is thin
    MeshingOptions options;
    options.target_tets =
        std::max<std::int64_t>(min_tets, static_cast<std::int64_t>(tets_per_node * nodes));
    return build_hierarchy(surface_of_labels(labels_of(body), options).surface, options).hierarchy;
}

}  // namespace livetet
