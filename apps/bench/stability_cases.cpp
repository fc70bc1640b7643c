#include "apps/bench/stability_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "apps/verification/meshes.hpp"
#include "base/error.hpp"
#include "geometry/transform.hpp"
#include "mesh/cut_hierarchy.hpp"
#include "mesh/hex_cut.hpp"
#include "meshing/quality.hpp"

namespace livetet {

namespace {

const Vector3 extent(0.2, 0.1, 0.1);

/// 0 where a tet is inverted.
double min_dihedral(const TetMesh& mesh, std::span<const Tet> tets) {
    double least = 180;
    for (const Tet& t : tets) {
        if (!(signed_volume(mesh, t) > 0)) return 0;
        for (const double angle : dihedral_angles_deg(mesh.nodes[t[0]], mesh.nodes[t[1]],
                                                      mesh.nodes[t[2]], mesh.nodes[t[3]]))
            least = std::min(least, angle);
    }
    return least;
}

/// Moves inner nodes, no two of one tet, towards the opposite face of one of their tets until the
/// least angle there is `angle`.
void flatten(TetMesh& mesh, double angle) {
    std::vector<std::vector<Tet>> around(mesh.nodes.size());
    for (const Tet& t : mesh.tets)
        for (const std::int32_t n : t) around[n].push_back(t);
    std::set<std::int32_t> taken;  // nodes of the surface, and of tets with a node that was moved
    for (const auto& [name, nodes] : mesh.node_sets) taken.insert(nodes.begin(), nodes.end());
    int flattened = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const auto n = static_cast<std::int32_t>(i);
        if (taken.contains(n)) continue;
        const Vector3 from = mesh.nodes[i];
        Vector3 to = Vector3::Zero();
        for (const std::int32_t m : around[i].front())
            if (m != n) to += mesh.nodes[m] / 3;
        double near = 0, far = 1;
        for (int halving = 0; halving < 60; ++halving) {
            const double share = (near + far) / 2;
            mesh.nodes[i] = from + share * (to - from);
            (min_dihedral(mesh, around[i]) > angle ? near : far) = share;
        }
        mesh.nodes[i] = from + near * (to - from);
        for (const Tet& t : around[i]) taken.insert(t.begin(), t.end());
        ++flattened;
    }
    const double least = min_dihedral(mesh, mesh.tets);
    if (flattened == 0 || least > 1.01 * angle || least < 0.99 * angle)
        fail("stability: {} tets flattened to {:.3g} degrees, expected {:.3g}", flattened, least,
             angle);
}

}  // namespace

int StabilityCase::driven_steps(int noise_frames) const {
    switch (motion) {
        case PatchMotion::none:
            return 0;
        case PatchMotion::jump:
        case PatchMotion::deep_press:
            return 1;
        case PatchMotion::press:
            return 10;
        case PatchMotion::through:
            return 20;
        case PatchMotion::turn:
            return 40;
        case PatchMotion::noise:
            return noise_frames;
    }
    return 0;
}

double StabilityCase::period_s() const {
    const double frequency =
        3.516 / (2 * std::numbers::pi * extent.x() * extent.x()) *
        std::sqrt(young_Pa * extent.z() * extent.z() / (12 * density_kg_per_m3));
    return 1 / frequency;
}

std::vector<StabilityCase> stability_cases() {
    std::vector<StabilityCase> cases;
    const auto vary = [&](const std::string& group, std::initializer_list<double> values,
                          auto&& set) {
        for (const double value : values) {
            StabilityCase c;
            c.group = group;
            c.value = fmt::format("{:g}", value);
            set(c, value);
            cases.push_back(c);
        }
    };
    const auto add = [&](const std::string& group, const std::string& value, auto&& set) {
        StabilityCase c;
        c.group = group;
        c.value = value;
        set(c);
        cases.push_back(c);
    };
    vary("Poisson's ratio", {0, 0.3, 0.45, 0.49, 0.499, 0.4999},
         [](StabilityCase& c, double v) { c.poisson = v; });
    vary("Young's modulus, Pa", {1, 1e6, 1e9, 1e12},
         [](StabilityCase& c, double v) { c.young_Pa = v; });
    vary("contrast", {1e2, 1e4, 1e6, 1e8}, [](StabilityCase& c, double v) { c.contrast = v; });
    vary("density, kg/m^3", {1e-6, 1, 1e6},
         [](StabilityCase& c, double v) { c.density_kg_per_m3 = v; });
    vary("least angle, degrees", {10, 5, 1, 0.1, 0.01},
         [](StabilityCase& c, double v) { c.min_dihedral_deg = v; });
    vary("edge ratio", {10, 100, 1000}, [](StabilityCase& c, double v) { c.edge_ratio = v; });
    vary("time step, s", {1e-5, 1e-3, 0.1, 1, 10},
         [](StabilityCase& c, double v) { c.step_s = v; });
    add("patch", "jumps by the body's length",
        [](StabilityCase& c) { c.motion = PatchMotion::jump; });
    add("patch", "turns by 720 degrees", [](StabilityCase& c) { c.motion = PatchMotion::turn; });
    add("patch", "presses through the far wall",
        [](StabilityCase& c) { c.motion = PatchMotion::through; });
    add("start", "flat",
        [](StabilityCase& c) { c.start = StartState::flat, c.motion = PatchMotion::none; });
    add("start", "everted",
        [](StabilityCase& c) { c.start = StartState::everted, c.motion = PatchMotion::none; });
    add("start", "random",
        [](StabilityCase& c) { c.start = StartState::random, c.motion = PatchMotion::none; });
    add("held by", "a line", [](StabilityCase& c) { c.held = HeldBy::line; });
    add("held by", "one node", [](StabilityCase& c) { c.held = HeldBy::node; });
    add("deep press", "on ten-node tets",
        [](StabilityCase& c) { c.motion = PatchMotion::deep_press, c.is_fine = true; });
    vary("cut, share of the height", {0.5, 0.7},
         [](StabilityCase& c, double v) { c.cut_share = v; });
    add("noise", "of 1.4 mm", [](StabilityCase& c) { c.motion = PatchMotion::noise; });
    return cases;
}

namespace {

PlanePatch cut_of(const StabilityCase& c) {
    PlanePatch patch{extent / 2, Vector3::UnitX()};
    patch.point.z() = 0;
    patch.edges = {2 * extent.y() * Vector3::UnitY(),
                   2 * c.cut_share * extent.z() * Vector3::UnitZ()};
    return patch;
}

}  // namespace

MeshHierarchy stability_mesh(const StabilityCase& c, int cells) {
    std::vector<TetMesh> levels;
    for (const int n : {cells, std::max(1, cells / 2)}) {
        TetMesh mesh = verification::box(extent, {2 * n, n, n}, 0.1);
        const double layer = extent.z() / cells, thin = layer / c.edge_ratio;
        for (const Tet& t : mesh.tets) {
            double z = 0;
            for (const std::int32_t i : t) z += mesh.nodes[i].z() / 4;
            mesh.regions.push_back(z < extent.z() / 2 ? 1 : 2);
        }
        if (c.edge_ratio > 1)
            for (Vector3& x : mesh.nodes) {
                const double below = extent.z() - layer;
                if (std::abs(x.z() - below) < layer / 4)
                    x.z() = below;  // a plane, as the thin layer's other side is
                x.z() = x.z() <= below ? x.z() * (extent.z() - thin) / below
                                       : extent.z() - (extent.z() - x.z()) / c.edge_ratio;
            }
        if (levels.empty() && c.min_dihedral_deg > 0) flatten(mesh, c.min_dihedral_deg);
        check_tet_mesh(mesh, "stability");
        levels.push_back(std::move(mesh));
    }
    if (c.cut_share == 0) return make_hierarchy(std::move(levels), "stability");
    cut_levels(levels, cut_of(c), "stability");
    return with_cut_transfers(std::move(levels), "stability");
}

MeshHierarchy stability_grid(const StabilityCase& c, int cells) {
    std::vector<HexPlace> places;
    std::vector<HexLink> links;
    const HexPlace size{2 * cells, cells, cells};
    const HexPlace steps{1, size[0], size[0] * size[1]};
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i) {
                const auto cell = static_cast<std::int32_t>(places.size());
                places.push_back({i, j, k});
                for (int d = 0; d < 3; ++d)
                    if (places.back()[d] + 1 < size[d]) links.push_back({cell, cell + steps[d], d});
            }
    HexLevel level = make_hex_level(std::move(places), std::move(links));
    TetMesh mesh;
    mesh.nodes.resize(static_cast<std::size_t>(level.nodes));
    for (std::size_t e = 0; e < level.cells.size(); ++e)
        for (int corner = 0; corner < 8; ++corner)
            for (int d = 0; d < 3; ++d)
                mesh.nodes[level.cells[e][corner]][d] =
                    extent[d] * (level.places[e][d] + (corner >> d & 1)) / size[d];
    mesh.hexahedra = level.cells;
    mesh.shares.assign(mesh.hexahedra.size(), 1);
    mesh.tets = tets_of_hexahedra(mesh.hexahedra);
    for (const HexPlace& place : level.places)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron,
                            2 * place[2] + 1 < cells ? 1 : 2);
    if (c.cut_share > 0)
        mesh = without_links(mesh, level,
                             crossed_links(level, grid_frame(mesh, level), cut_of(c), "stability"));
    return make_hierarchy({std::move(mesh)}, "stability");
}

Scene stability_scene(const StabilityCase& c, const ModelChoice& strain, TimeScheme scheme,
                      const TetMesh& mesh) {
    Scene scene;
    scene.strain = strain;
    if (c.is_fine) scene.elements = Elements::p2;
    const Material lower{c.young_Pa, c.poisson, c.density_kg_per_m3, 1};
    Material upper = lower;
    upper.young_Pa = c.contrast * upper.young_Pa;
    upper.region = 2;
    scene.materials = {lower, upper};
    scene.time.scheme = scheme;
    scene.time.step_s = c.step_s;
    // A quarter of critical for the first bending, and what brings modes to rest that no step
    // resolves.
    scene.time.rayleigh_alpha = std::numbers::pi / c.period_s();
    scene.time.rayleigh_beta = c.period_s() / 64;
    FixOptions fix;
    if (c.held == HeldBy::face) {
        fix.half_space_mm = {1e-3, 0, 0, 1, 0, 0};
    } else {
        std::vector<int> held;
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            const Vector3& x = mesh.nodes[n];
            if (x.x() < 1e-9 && x.z() < 1e-9 && (c.held == HeldBy::line || held.empty()))
                held.push_back(static_cast<int>(n));
        }
        fix.nodes = held;
    }
    scene.fix = {fix};
    return scene;
}

std::vector<std::int32_t> stability_patch(const StabilityCase& c, const TetMesh& mesh) {
    std::vector<std::int32_t> patch;
    if (c.motion == PatchMotion::none) return patch;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        const Vector3& x = mesh.nodes[n];
        const bool is_in = c.motion == PatchMotion::turn ? x.x() > extent.x() - 1e-9
                           : c.motion == PatchMotion::deep_press
                               ? (x - Vector3(0.1, 0.05, extent.z())).norm() < 0.012
                               : x.z() > extent.z() - 1e-9 && std::abs(x.x() - 0.1) < 0.026 &&
                                     std::abs(x.y() - 0.05) < 0.026;
        if (is_in) patch.push_back(static_cast<std::int32_t>(n));
    }
    return patch;
}

Vector3 patch_displacement(const StabilityCase& c, const Vector3& x, int k, int steps) {
    const double share = static_cast<double>(k) / steps;
    const double smooth = (1 - std::cos(std::numbers::pi * share)) / 2;  // begins and ends at rest
    switch (c.motion) {
        case PatchMotion::press:
            return {0, 0, -0.02 * smooth};
        case PatchMotion::deep_press:
            return {0, 0, -0.015};
        case PatchMotion::jump:
            return {0, 0, extent.x()};
        case PatchMotion::through:
            return {0, 0, -0.15 * smooth};
        case PatchMotion::turn: {
            const Vector3 centre(x.x(), extent.y() / 2, extent.z() / 2);
            return rotation_of_vector({4 * std::numbers::pi * smooth, 0, 0}) * (x - centre) -
                   (x - centre);
        }
        case PatchMotion::noise: {
            std::mt19937 generator(static_cast<std::uint32_t>(k));
            std::normal_distribution<double> noise(0, 0.0014 / std::sqrt(3.0));
            const double dx = noise(generator), dy = noise(generator), dz = noise(generator);
            return {dx, dy, dz - 0.01};
        }
        case PatchMotion::none:
            break;
    }
    return Vector3::Zero();
}

std::vector<Vector3> start_displacement(StartState start, const TetMesh& mesh) {
    std::mt19937 generator(7);
    std::vector<Vector3> u(mesh.nodes.size(), Vector3::Zero());
    for (std::size_t i = 0; i < u.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        Vector3 to = x;
        if (start == StartState::flat) to.z() = extent.z() / 2;
        if (start == StartState::everted) to.x() = -x.x();
        if (start == StartState::random)
            for (int a = 0; a < 3; ++a)
                to[a] = std::generate_canonical<double, 53>(generator) * extent[a];
        u[i] = to - x;
    }
    return u;
}

}  // namespace livetet
