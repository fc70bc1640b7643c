#include "solvers/nonlinear/body_state.hpp"

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

BodySnapshot gather_state(const PartitionedMesh& mesh, const BodyState& state) {
    BodySnapshot snapshot;
    for (const PetscHandle<Vec>* vector : {&state.u, &state.v, &state.a, &state.end_force})
        if (*vector) snapshot.nodal.push_back(gather(mesh, vector->get()));
    if (state.p) {
        const ReadArray mine(state.p.get());
        PetscInt corners = 0;
        LIVETET_PETSC(VecGetSize(state.p.get(), &corners));
        snapshot.pressure.assign(static_cast<std::size_t>(corners), 0);
        for (std::size_t i = 0; i < mine.span().size(); ++i)
            snapshot.pressure[mesh.nodes[i]] = mine[i];
        if (mesh.ranks > 1)
            MPI_Allreduce(MPI_IN_PLACE, snapshot.pressure.data(), static_cast<int>(corners),
                          MPI_DOUBLE, MPI_SUM, mesh.comm);
    }
    snapshot.started = state.started;
    return snapshot;
}

void restore_state(const PartitionedMesh& mesh, const BodySnapshot& snapshot, BodyState& state) {
    std::size_t k = 0;
    for (const PetscHandle<Vec>* vector : {&state.u, &state.v, &state.a, &state.end_force}) {
        if (!*vector) continue;
        if (k >= snapshot.nodal.size() || snapshot.nodal[k].size() != mesh.number_of_node.size())
            fail("the state of a body has {} fields, {} nodes in number {}, expected {} nodes",
                 snapshot.nodal.size(), k < snapshot.nodal.size() ? snapshot.nodal[k].size() : 0, k,
                 mesh.number_of_node.size());
        fill(mesh, snapshot.nodal[k++], vector->get());
    }
    if (state.p) {
        WriteArray mine(state.p.get());
        PetscInt corners = 0;
        LIVETET_PETSC(VecGetSize(state.p.get(), &corners));
        if (snapshot.pressure.size() != static_cast<std::size_t>(corners))
            fail("the state of a body has {} pressures, expected {}", snapshot.pressure.size(),
                 corners);
        for (std::size_t i = 0; i < mine.span().size(); ++i)
            mine[i] = snapshot.pressure[mesh.nodes[i]];
    }
    state.started = snapshot.started;
}

}  // namespace livetet
