#include "apps/live/listed_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/live/blade_cuts.hpp"
#include "apps/live/response_nodes.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/node_selection.hpp"
#include "mechanics/rigid_motions.hpp"

namespace livetet {

namespace {

constexpr std::uint8_t all_held = 7;

/// Which components of each node are held: all where a spring pulls.
std::vector<std::uint8_t> held_by(const Scene& listed, const TetMesh& mesh) {
    const SceneConstraints constraints(listed, mesh);
    std::vector<std::uint8_t> held = constraints.constraints().components;
    for (std::size_t n = 0; n < constraints.springs().stiffness.size(); ++n)
        if (constraints.springs().stiffness[n] > 0) held[n] = all_held;
    return held;
}

bool can_move_rigidly(std::span<const std::int32_t> nodes, const MeshPiece& piece,
                      const TetMesh& mesh, const std::vector<std::uint8_t>& held) {
    double size = 0;
    for (const std::int32_t n : nodes)
        size = std::max(size, (mesh.nodes[n] - piece.centroid).norm());
    RigidMotionConstraints motions(piece.centroid, size);
    for (const std::int32_t n : nodes)
        if (held[n]) motions.constrain(mesh.nodes[n], held[n]);
    return !motions.constrains_all();
}

}  // namespace

Scene listed_scene(const Scene& scene, const TetMesh& mesh) {
    Scene listed = scene;
    listed.cuts.clear();
    list_selected_nodes(listed, mesh);
    for (DriveOptions& drive : listed.drive) {
        if (drive.centre_mm) continue;
        Vector3 centre = Vector3::Zero();
        for (const int n : *drive.nodes)
            centre += mesh.nodes[n] / static_cast<double>(drive.nodes->size());
        drive.centre_mm = 1e3 * centre;
    }
    for (std::size_t i = 0; i < listed.loads.size(); ++i) {
        LoadOptions& load = listed.loads[i];
        if (load.group) continue;
        const auto nodes = select_nodes(mesh, load, fmt::format("loads[{}]", i));
        static_cast<SelectionOptions&>(load) = {};
        load.nodes.emplace(nodes.begin(), nodes.end());
    }
    return listed;
}

void add_copies_to_lists(Scene& listed, std::size_t first,
                         std::span<const std::int32_t> originals) {
    const auto add = [&](auto& sets) {
        for (SelectionOptions& set : sets)
            if (set.nodes) add_copies(*set.nodes, first, originals);
    };
    add(listed.fix);
    add(listed.drive);
    add(listed.loads);
}

HeldPieces held_pieces(const Scene& listed, const TetMesh& mesh) {
    const std::vector<std::uint8_t> held = held_by(listed, mesh);
    std::vector<MeshPiece> pieces = mesh_pieces(mesh);
    HeldPieces found{pieces.size(), {}, false};
    if (std::ranges::all_of(held, [](std::uint8_t bits) { return bits == 0; })) {
        found.is_any_left = true;
        found.free.assign(std::make_move_iterator(pieces.begin() + 1),
                          std::make_move_iterator(pieces.end()));
        return found;
    }
    for (MeshPiece& piece : pieces) {
        const std::vector<std::int32_t> nodes = nodes_of_pieces({&piece, 1}, mesh);
        const bool is_free =
            listed.time.is_dynamic()
                ? std::ranges::all_of(nodes, [&](std::int32_t n) { return held[n] == 0; })
                : can_move_rigidly(nodes, piece, mesh, held);
        found.is_any_left |= !is_free && std::ranges::any_of(nodes, [&](std::int32_t n) {
            return held[n] != all_held;
        });
        if (is_free) found.free.push_back(std::move(piece));
    }
    return found;
}

}  // namespace livetet
