#include "solvers/nonlinear/body_input.hpp"

#include <algorithm>

#include "config/check_fields.hpp"

namespace livetet {

namespace {

void check_parts(const DistributedHierarchy& mesh) {
    int ranks = 1;
    MPI_Comm_size(mesh.comm, &ranks);
    if (ranks == 1) return;
    const std::vector<TetMesh>& levels = mesh.hierarchy.levels;
    if (mesh.parts.size() != levels.size())
        fail(
            "mesh hierarchy: found parts of {} levels on {} ranks, expected those of {} levels "
            "(see "
            "partition_levels)",
            mesh.parts.size(), ranks, levels.size());
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const std::vector<std::int32_t>& parts = mesh.parts[l];
        if (parts.size() != levels[l].tets.size())
            fail("mesh hierarchy: found parts of {} tets in level {}, expected {}", parts.size(), l,
                 levels[l].tets.size());
        const auto [low, high] = std::minmax_element(parts.begin(), parts.end());
        if (*low < 0 || *high >= ranks)
            fail("mesh hierarchy: found parts {} to {} in level {}, expected 0 to {}", *low, *high,
                 l, ranks - 1);
    }
}

void check_model(ElasticModel model) {
    if (model.materials.empty()) fail("materials: found none, expected at least one");
    for (std::size_t m = 0; m < model.materials.size(); ++m) {
        check_fields(model.materials[m], fmt::format("materials[{}].", m));
        if (!model.materials[m].model && !model.strain)
            fail("materials[{}] and its body name no constitutive model, expected one", m);
    }
    FieldChecker checker("");
    visit_keys(checker, model.strain);
}

}  // namespace

void check_body_input(const DistributedHierarchy& mesh, const ElasticModel& model,
                      const TimeOptions& time, const SolverOptions& options) {
    PetscBool runs = PETSC_FALSE;
    LIVETET_PETSC(PetscInitialized(&runs));
    if (!runs)
        fail("a DeformableBody needs PETSc: found no PetscSession, expected one made before");
    check_hierarchy(mesh.hierarchy);
    check_parts(mesh);
    check_model(model);
    check_fields(time, "time.");
    check_fields(options, "solver.");
}

}  // namespace livetet
