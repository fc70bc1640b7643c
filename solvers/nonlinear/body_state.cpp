#include "solvers/nonlinear/body_state.hpp"

#include <algorithm>
#include <numeric>

#include "base/error.hpp"

namespace livetet {

std::vector<Vec> BodyState::vectors() const {
    std::vector<Vec> all{u.get()};
    for (const PetscHandle<Vec>* vector : {&v, &a, &end_force, &p})
        if (*vector) all.push_back(vector->get());
    return all;
}

void BodyState::copy_from(const BodyState& other) {
    const std::vector<Vec> mine = vectors(), theirs = other.vectors();
    if (!other.u) fail("the state of a body: found none that was kept, expected one");
    if (theirs.size() != mine.size())
        fail("the state of a body has {} fields, expected {}: the time scheme or the form differs",
             theirs.size(), mine.size());
    for (std::size_t i = 0; i < mine.size(); ++i) LIVETET_PETSC(VecCopy(theirs[i], mine[i]));
    started = other.started;
}

BodyState BodyState::duplicate() const {
    BodyState twin;
    const auto make = [](const PetscHandle<Vec>& from, PetscHandle<Vec>& to) {
        if (from) LIVETET_PETSC(VecDuplicate(from.get(), to.out()));
    };
    make(u, twin.u);
    make(v, twin.v);
    make(a, twin.a);
    make(end_force, twin.end_force);
    make(p, twin.p);
    return twin;
}

RowBlocks node_blocks(const PartitionedMesh& mesh) {
    return {mesh.comm, mesh.total, std::span(mesh.nodes).first(mesh.owned)};
}

namespace {

/// Of the whole mesh, where there are any: one at each corner, or one or four in each cell.
std::size_t pressure_count(const PartitionedMesh& mesh) {
    if (!mesh.quadratic_hexahedra.empty()) return 4 * mesh.quadratic_hexahedra.size();
    return mesh.hexahedra.empty() ? static_cast<std::size_t>(mesh.corners) : mesh.hexahedra.size();
}

/// Of the pressures of `p`: those of corners are owned with them, the first of the rank's own
/// nodes; hexahedra are on one rank.
RowBlocks pressure_blocks(const PartitionedMesh& mesh, const BodyState& state) {
    PetscInt here = 0;
    LIVETET_PETSC(VecGetLocalSize(state.p.get(), &here));
    std::vector<std::int32_t> numbers(static_cast<std::size_t>(here));
    if (!mesh.has_hexahedra())
        std::copy_n(mesh.nodes.begin(), here, numbers.begin());
    else
        std::iota(numbers.begin(), numbers.end(), 0);
    return {mesh.comm, pressure_count(mesh), numbers};
}

}  // namespace

BodySnapshot gather_state(const PartitionedMesh& mesh, const BodyState& state) {
    BodySnapshot snapshot;
    snapshot.node_count = mesh.total;
    const RowBlocks nodes = node_blocks(mesh);
    for (const PetscHandle<Vec>* vector : {&state.u, &state.v, &state.a, &state.end_force})
        if (*vector) {
            const ReadArray mine(vector->get());
            snapshot.nodal.push_back(nodes.to_block(mine.span(), 3));
        }
    if (state.p) {
        snapshot.pressure_count = pressure_count(mesh);
        const ReadArray mine(state.p.get());
        snapshot.pressure = pressure_blocks(mesh, state).to_block(mine.span(), 1);
    }
    snapshot.started = state.started;
    return snapshot;
}

void restore_state(const PartitionedMesh& mesh, const BodySnapshot& snapshot, BodyState& state) {
    std::size_t fields = 0;
    for (const PetscHandle<Vec>* vector : {&state.u, &state.v, &state.a, &state.end_force})
        fields += *vector ? 1 : 0;
    const std::size_t pressures = state.p ? pressure_count(mesh) : 0;
    if (snapshot.nodal.size() != fields || snapshot.node_count != mesh.total ||
        snapshot.pressure_count != pressures)
        fail(
            "the state of a body has {} fields of {} nodes and {} pressures, expected {} fields of "
            "{} nodes and {} pressures",
            snapshot.nodal.size(), snapshot.node_count, snapshot.pressure_count, fields, mesh.total,
            pressures);
    const auto take = [](const RowBlocks& blocks, const std::vector<double>& of_block,
                         int components, Vec to) {
        const std::vector<double> values = blocks.from_block(of_block, components);
        WriteArray mine(to);
        std::copy(values.begin(), values.end(), mine.span().begin());
    };
    const RowBlocks nodes = node_blocks(mesh);
    std::size_t k = 0;
    for (const PetscHandle<Vec>* vector : {&state.u, &state.v, &state.a, &state.end_force})
        if (*vector) take(nodes, snapshot.nodal[k++], 3, vector->get());
    if (state.p) take(pressure_blocks(mesh, state), snapshot.pressure, 1, state.p.get());
    state.started = snapshot.started;
}

}  // namespace livetet
