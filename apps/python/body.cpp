#include <pybind11/stl.h>

#include <optional>

#include "apps/python/arrays.hpp"
#include "apps/python/budget.hpp"
#include "apps/python/engine.hpp"
#include "apps/python/scene.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/scene_forces.hpp"

namespace livetet::python {

namespace {

/// The body of a scene for a program that moves it itself.
class Body : public Closable {
  public:
    Body(const PyScene& scene, Use use, const py::object& progress) : scene_(scene.scene) {
        Watch watch(progress);
        in_engine([&] {
            try {
                make(watch, use);
            } catch (...) {
                body_.reset();  // here, with the engine's lock
                throw;
            }
        });
    }
    ~Body() override {
        destroy_in_engine([this] { close(); });
    }
    void close() noexcept override {
        if (body_) body_->body.reset();
    }

    const TetMesh& mesh() const { return body_->mesh(); }
    Mesh python_mesh() const { return {body_, mesh()}; }

    void prescribe(const IntArray& nodes, const DoubleArray& values,
                   const std::string& components) {
        if (components.empty()) fail("components: found none, expected some of x, y, z");
        std::uint8_t which = 0;
        for (const char c : components) {
            if (c < 'x' || c > 'z') fail("components = {}: expected some of x, y, z", components);
            which |= static_cast<std::uint8_t>(1 << (c - 'x'));
        }
        const auto [chosen, rows] = checked(nodes, values);
        in_engine([&] {
            Constraints changed = *constraints_;
            for (std::size_t k = 0; k < chosen.size(); ++k)
                changed.prescribe(chosen.subspan(k, 1), rows[k], which);
            open().set_constraints(changed);
            constraints_ = std::move(changed);
        });
    }
    void release(const IntArray& nodes) {
        const auto chosen = numbers(nodes, "nodes");
        check_nodes(chosen);
        in_engine([&] {
            for (const std::int32_t n : chosen) {
                constraints_->components[n] = 0;
                constraints_->values[n].setZero();
            }
            open().set_constraints(*constraints_);
        });
    }
    void move(const IntArray& nodes, const DoubleArray& values) {
        const auto [chosen, rows] = checked(nodes, values);
        in_engine([&] {
            open().move_constraints(chosen, rows);
            for (std::size_t k = 0; k < chosen.size(); ++k)
                constraints_->values[chosen[k]] = rows[k];
        });
    }
    StepReport solve(double dt) {
        Watch watch(py::none{});
        return in_engine([&] {
            const SceneOptions options(scene_.solver.petsc_options);
            SolveControls controls = solve_controls(scene_);
            controls.observe = [&](const NewtonProgress&) { watch.check_signals(); };
            const StepReport report = open().solve(dt, controls);
            open().displacement(displacement);
            return report;
        });
    }
    StepReport advance(double dt, std::optional<double> budget_ms) {
        const auto start = Clock::now();
        return in_engine([&] {
            FrameControls controls;
            controls.newton_iterations = newton_iterations_;
            controls.deadline = deadline_of(start, budget_ms);
            const StepReport report = open().advance(dt, controls);
            open().displacement(displacement);
            return report;
        });
    }
    py::array reactions() {
        return owned(in_engine([&] { return open().reactions(); }));
    }
    py::array stress() {
        std::vector<Eigen::Matrix3d> stress = in_engine([&] { return open().nodal_stress(); });
        const auto count = std::ssize(stress);
        std::vector<double> numbers(stress.front().data(), stress.front().data() + 9 * count);
        return owned(std::move(numbers), {count, 3, 3});
    }
    double strain_energy() {
        return in_engine([&] { return open().strain_energy(); });
    }
    std::string solver() {
        return in_engine([&] { return std::string(open().linear_solver().name()); });
    }

    std::vector<Vector3> displacement;  ///< of each node, m, after the last step

  private:
    void make(Watch& watch, Use use) {
        const SceneOptions options(scene_.solver.petsc_options);
        body_ = std::make_shared<SceneBody>(
            make_body(PETSC_COMM_SELF, scene_, load_mesh(scene_, watch.callback()), use));
        SceneConstraints of_scene(scene_, mesh());
        of_scene.move_to_share(1);
        constraints_.emplace(of_scene.constraints());
        body_->body->set_constraints(*constraints_);
        body_->body->set_springs(of_scene.springs());
        body_->body->set_external_force(scene_forces(scene_, mesh()));
        body_->body->displacement(displacement);
    }
    DeformableBody& open() {
        if (!body_->body) fail("Body: is closed, expected calls before close()");
        return *body_->body;
    }
    void check_nodes(std::span<const std::int32_t> nodes) const {
        for (const std::int32_t n : nodes)
            if (n < 0 || n >= std::ssize(mesh().nodes))
                fail("nodes: found {}, expected 0 to {}", n, mesh().nodes.size() - 1);
    }
    std::pair<std::span<const std::int32_t>, std::span<const Vector3>> checked(
        const IntArray& nodes, const DoubleArray& values) const {
        const auto chosen = numbers(nodes, "nodes");
        const auto rows = rows3(values, "displacements");
        if (chosen.size() != rows.size())
            fail("displacements: found {} rows, expected one for each of {} nodes", rows.size(),
                 chosen.size());
        check_nodes(chosen);
        for (const Vector3& u : rows)
            if (!u.allFinite()) fail("displacements: found a number that is not finite");
        return {chosen, rows};
    }

    Scene scene_;
    const int newton_iterations_ = newton_iterations_of_frame(scene_);
    std::shared_ptr<SceneBody> body_;
    std::optional<Constraints> constraints_;
};

void bind_report(py::module_& module) {
    py::class_<StepReport>(module, "StepReport", "Result of a step, or of a frame.")
        .def_readonly("converged", &StepReport::converged,
                      "A step met its tolerance; a frame's linear solve did, or was cut short.")
        .def_readonly("cut_short", &StepReport::cut_short, "The deadline ended a linear solve.")
        .def_readonly("late", &StepReport::late, "A frame ended after its deadline.")
        .def_readonly("kept_old", &StepReport::kept_old,
                      "The new state was not usable: the old one is kept.")
        .def_readonly("newton_iterations", &StepReport::newton_iterations, "Of Newton's method.")
        .def_readonly("iterations", &StepReport::iterations, "Of all linear solves.")
        .def_readonly("imbalance", &StepReport::imbalance,
                      "Residual relative to the forces at work.")
        .def_readonly("linear_error", &StepReport::linear_error,
                      "Estimated error of a frame's linear solve alone, m, RMS over the nodes; 0: "
                      "not known.")
        .def_property_readonly(
            "reason", [](const StepReport& r) { return std::string(r.reason); },
            "Why the step ended, or its state was dropped.")
        .def_property_readonly("seconds", &StepReport::seconds, "Time of all stages.");
}

}  // namespace

void bind_body(py::module_& module) {
    bind_report(module);
    py::class_<Body>(module, "Body",
                     "The body of a scene, for a program of its own: it moves nodes, and the body "
                     "follows. Constraints, springs and loads of the scene are set.")
        .def(py::init([](const PyScene& scene, bool live, const py::object& progress) {
                 return std::make_unique<Body>(scene, live ? Use::track : Use::solve, progress);
             }),
             py::arg("scene"), py::arg("live") = false, py::arg("progress") = py::none(),
             "live: with the solver that `livetet track` takes, for frames of some ms.")
        .def_property_readonly("mesh", &Body::python_mesh, "The finest mesh.")
        .def_property_readonly("solver", &Body::solver, "Name of the linear solver.")
        .def_property_readonly(
            "displacement",
            [](const py::object& self) {
                return view(self.cast<const Body&>().displacement, self);
            },
            "Of each node (n, 3), m: a view, which the next step overwrites; copy() keeps it.")
        .def("prescribe", &Body::prescribe, py::arg("nodes"), py::arg("displacements"),
             py::arg("components") = "xyz", "Constrains nodes (k,) to displacements (k, 3), m.")
        .def("release", &Body::release, py::arg("nodes"), "Frees nodes (k,).")
        .def("move", &Body::move, py::arg("nodes"), py::arg("displacements"),
             "New displacements (k, 3), m, of constrained nodes (k,); in every frame.")
        .def("solve", &Body::solve, py::arg("dt") = 0.0,
             "A step of dt s (static: equilibrium) to the scene's tolerance.")
        .def("advance", &Body::advance, py::arg("dt") = 0.0, py::arg("budget_ms") = py::none(),
             "A frame of dt s, which aims to end within the budget.")
        .def("reactions", &Body::reactions, "Force (n, 3), N, of the constraints on each node.")
        .def("stress", &Body::stress, "Cauchy's stress (n, 3, 3), Pa, at each node.")
        .def("strain_energy", &Body::strain_energy, "J")
        .def(
            "close", [](Body& body) { destroy_in_engine([&body] { body.close(); }); },
            "Frees the solver's memory now; arrays and mesh stay.");
}

}  // namespace livetet::python
