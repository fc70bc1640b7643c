#include "solvers/nonlinear/body_input.hpp"

#include "config/check_fields.hpp"

namespace livetet {

namespace {

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

void check_body_input(const ElasticModel& model, const TimeOptions& time,
                      const SolverOptions& options) {
    check_model(model);
    check_fields(time, "time.");
    check_fields(options, "solver.");
}

}  // namespace livetet
