#include "apps/python/scene.hpp"

#include <pybind11/stl.h>

#include "apps/python/arrays.hpp"
#include "apps/python/engine.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/simulation/solve_scene.hpp"
#include "config/key_places.hpp"
#include "config/yaml.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet::python {

namespace {

PyScene parse(const py::object& text_or_dict, const py::object& folder) {
    const std::string text = yaml_text_of(text_or_dict), name = "scene";
    PyScene scene{read_yaml<Scene>(text, name), name};
    finish_scene(scene.scene, KeyPlaces(name, text), path_of(folder));
    return scene;
}

py::object python_of(const YAML::Node& node) {
    if (node.IsMap()) {
        py::dict dict;
        for (const auto& entry : node)
            dict[py::str(entry.first.as<std::string>())] = python_of(entry.second);
        return dict;
    }
    if (node.IsSequence()) {
        py::list list;
        for (const auto& entry : node) list.append(python_of(entry));
        return list;
    }
    if (!node.IsScalar()) return py::none();
    const std::string& text = node.Scalar();
    if (node.Tag() == "!") return py::str(text);  // quoted
    if (long long whole = 0; YAML::convert<long long>::decode(node, whole)) return py::int_(whole);
    if (double number = 0; YAML::convert<double>::decode(node, number)) return py::float_(number);
    if (bool flag = false; YAML::convert<bool>::decode(node, flag)) return py::bool_(flag);
    return py::str(text);
}

/// Result of a solve, without PETSc's objects.
struct Solution {
    SolvedScene solved;
    Mesh mesh;
    std::optional<std::string> file;
};

/// Checks a scene as a solve does before its steps. Returns the notes.
std::vector<std::string> check(const PyScene& self) {
    Watch watch(py::none{});
    return in_engine([&] {
        const MeshHierarchy hierarchy = load_mesh(self.scene, watch.callback());
        const SceneConstraints constraints(self.scene, hierarchy.levels.front());
        if (!self.scene.track)
            check_no_free_motion(self.scene, hierarchy.levels.front(), constraints);
        std::vector<std::string> notes;
        const TetMesh& mesh = hierarchy.levels.front();
        for (const auto& note : {locking_note(self.scene), swinging_note(self.scene, mesh)})
            if (note) notes.push_back(*note);
        return notes;
    });
}

/// `livetet solve`. Throws NotConverged, with the solution, if `must_converge`.
py::object solve(const PyScene& self, const py::object& output, const py::object& progress,
                 bool restart, bool must_converge) {
    Scene scene = self.scene;
    if (!output.is_none()) scene.output.file = path_of(output);
    if (scene.output.has_file() && scene.output.file.extension() != ".h5")
        fail("output = {}: expected a file name that ends in .h5, or none",
             scene.output.file.string());
    Watch watch(progress);
    PetscSession* session = start_engine();
    auto solution = in_engine([&] {
        const SceneOptions options(scene.solver.petsc_options);
        const auto tell = [&](PetscSession::Moment moment) {
            if (session) session->tell_unused_options(moment);
        };
        SolvedScene solved =
            solve_scene(scene, {.start = restart ? RunStart::from_checkpoint : RunStart::anew,
                                .whole = true,
                                .progress = watch.callback(),
                                .iterated = [&] {
                                    watch.check_signals();
                                    tell(PetscSession::Moment::set_up);
                                }});
        tell(PetscSession::Moment::end);
        solved.body.body.reset();
        auto hierarchy = std::make_shared<const MeshHierarchy>(std::move(solved.body.hierarchy));
        Mesh mesh(hierarchy, hierarchy->levels.front());  // the coarser levels may be empty
        const bool has_file = scene.output.has_file() && solved.frames > 0;
        return Solution{std::move(solved), std::move(mesh),
                        has_file ? std::optional(scene.output.file.string()) : std::nullopt};
    });
    const bool converged = solution.solved.history.converged;
    const std::string failure = solution.solved.history.failure;
    py::object result = py::cast(std::move(solution));
    if (converged || !must_converge) return result;
    const py::object raised = py::module_::import("livetet").attr("NotConverged")(py::str(failure));
    raised.attr("solution") = result;
    PyErr_SetObject(py::type::handle_of(raised).ptr(), raised.ptr());
    throw py::error_already_set();
}

py::dict forces(const Solution& s) {
    py::dict dict;
    for (const auto& [key, force] : s.solved.figures.forces) dict[py::str(key)] = vector(force);
    return dict;
}

void bind_solution(py::module_& module) {
    py::class_<Solution>(module, "Solution", "Result of a solve of a scene.")
        .def_readonly("mesh", &Solution::mesh, "The mesh, with ten-node tets' midpoints.")
        .def_property_readonly(
            "displacement",
            [](const py::object& self) {
                return view(self.cast<const Solution&>().solved.displacement, self);
            },
            "Of each node (n, 3) at the end, m. A view.")
        .def_property_readonly(
            "converged", [](const Solution& s) { return s.solved.history.converged; },
            "Whether every step met its tolerance.")
        .def_property_readonly(
            "failure", [](const Solution& s) { return s.solved.history.failure; },
            "One sentence if not converged.")
        .def_property_readonly(
            "frames", [](const Solution& s) { return s.solved.frames; },
            "Number of states that were kept.")
        .def_property_readonly("forces", &forces,
                               "Force on the body (3,), N, of each of fix and drive, by its key.")
        .def_property_readonly(
            "info", [](const Solution& s) { return python_of_json(s.solved.description); },
            "Steps, iterations, times and memory: a dict, as of `livetet solve --json`.")
        .def_readonly("file", &Solution::file, "Name of the result file; None: nothing was kept.")
        .def(
            "result",
            [](const Solution& s) {
                if (!s.file) fail("output.file = none: no result was kept, expected a file");
                return py::module_::import("livetet").attr("Result")(*s.file);
            },
            "Opens the result file.");
}

}  // namespace

py::object python_of_yaml(const std::string& text) { return python_of(YAML::Load(text)); }

py::object python_of_json(const std::string& text) {
    return py::module_::import("json").attr("loads")(text);
}

void bind_scene(py::module_& module) {
    module.attr("NotConverged") = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
        "livetet.NotConverged",
        "A solve did not converge: the message says why, `solution` is the last state.",
        PyExc_RuntimeError, nullptr));
    bind_solution(module);
    py::class_<PyScene>(module, "Scene",
                        "A checked scene: all that a run needs. See `livetet scene`.")
        .def_static(
            "load",
            [](const py::object& path) {
                const std::string file = path_of(path);
                return PyScene{load_scene(file), file};
            },
            py::arg("path"), "Reads a scene file.")
        .def(py::init(&parse), py::arg("scene"), py::arg("folder") = ".",
             "From YAML text or a dict of the same keys; relative paths begin at `folder`.")
        .def_property_readonly(
            "text", [](const PyScene& s) { return to_yaml(s.scene); },
            "The scene as YAML, with all defaults and whole paths.")
        .def(
            "to_dict", [](const PyScene& s) { return python_of_yaml(to_yaml(s.scene)); },
            "The scene as a dict, with all defaults and whole paths: change it and make another "
            "Scene of it.")
        .def(
            "mesh",
            [](const PyScene& s, const py::object& progress) {
                Watch watch(progress);
                return in_engine([&] {
                    return Mesh(std::make_shared<const MeshHierarchy>(
                        load_mesh(s.scene, watch.callback())));
                });
            },
            py::arg("progress") = py::none(), "Reads, or makes, the scene's mesh.")
        .def("check", &check,
             "Reads the mesh and all masks, and checks that the body cannot move freely, without "
             "solving. Returns notes on the model.")
        .def("solve", &solve, py::arg("output") = py::none(), py::arg("progress") = py::none(),
             py::arg("restart") = false, py::arg("must_converge") = true,
             "Solves the scene as `livetet solve` does, to the bit. output: a result file, or "
             "'none'; None: as the scene says. progress(fraction, text) is called now and then. "
             "restart: go on from the last checkpoint. Raises NotConverged, unless told not to. "
             "Ctrl-C ends it between two iterations of the linear solver, and leaves no file. "
             "Under mpirun all ranks call it.");
}

}  // namespace livetet::python
