#include <pybind11/pybind11.h>

#include <system_error>

#include "apps/python/engine.hpp"
#include "apps/python/mesh.hpp"
#include "base/error.hpp"
#include "base/petsc.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet::python {

namespace {

/// Errors with the texts that the program prints.
void bind_errors(py::module_& module) {
    static py::exception<Error>& error =
        *new py::exception<Error>(module, "Error", PyExc_ValueError);
    error.doc() = "Bad input: what was wrong, where, what was found and what was expected.";
    static py::exception<PetscFailure>& failure =
        *new py::exception<PetscFailure>(module, "PetscError", PyExc_RuntimeError);
    failure.doc() = "A call of PETSc failed.";
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            std::rethrow_exception(thrown);
        } catch (const Error& e) {
            error(e.what());
        } catch (const PetscFailure& e) {
            if (PetscSession::any_options() && e.may_be_an_option())
                error(fmt::format("PETSc cannot do this, expected options that it has for this "
                                  "solver: {}",
                                  e.what())
                          .c_str());
            else
                failure(e.what());
        } catch (const std::system_error& e) {
            PyErr_SetString(PyExc_OSError, e.what());
        }
    });
}

}  // namespace

PYBIND11_MODULE(livetet, module) {
    module.doc() =
        "Real-time soft-tissue simulation: meshes, scenes, solves, the tracked body, registration "
        "and results. SI units and RAS; names that end in _mm say otherwise.";
    module.attr("__version__") = LIVETET_VERSION;
    collect_messages();
    bind_errors(module);
    module.def("add_petsc_options", &add_petsc_options, py::arg("options"),
               "Options of PETSc for all that follows: '-ksp_monitor -ksp_rtol 1e-6'.");
    bind_mesh(module);
    bind_scene(module);
    bind_result(module);
    bind_body(module);
    bind_tracked_body(module);
    bind_registration(module);
}

}  // namespace livetet::python
