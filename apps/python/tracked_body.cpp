#include <pybind11/stl.h>

#include <cmath>
#include <optional>

#include "apps/live/track_inputs.hpp"
#include "apps/live/tracked_model.hpp"
#include "apps/live/tracker_source.hpp"
#include "apps/python/arrays.hpp"
#include "apps/python/budget.hpp"
#include "apps/python/engine.hpp"
#include "apps/python/scene.hpp"
#include "io/openigtlink/plus_pose.hpp"

namespace livetet::python {

namespace {

constexpr const char* registrations[] = {"valid", "held", "lost"};
constexpr const char* drives[] = {"placing", "following", "returning",
                                  "holding", "releasing", "released"};
constexpr const char* troubles[] = {"none",         "lost",     "invalid", "out_of_volume",
                                    "stale",        "broken",   "jumped",  "too_far",
                                    "no_reference", "restless", "slipped"};

py::array matrix4(const Eigen::Matrix3d& rotation, const Vector3& translation) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = rotation;
    m.topRightCorner<3, 1>() = translation;
    return matrix(m);
}

/// tracker_from_tool as a 4 x 4 matrix, m; None: not seen.
TrackedPose pose_of_python(const py::handle& value, const std::string& tool) {
    if (value.is_none()) return {};
    const auto array = DoubleArray::ensure(value);
    if (!array || array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) {
        PyErr_Clear();
        fail("poses[{}]: expected tracker_from_tool, a 4 x 4 matrix in m, or None", tool);
    }
    Eigen::Matrix4d m =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data());
    m.topRightCorner<3, 1>() *= 1e3;
    const auto pose = tracker_from_tool_mm(m);
    if (!pose) return {.status = PoseStatus::broken};
    return {pose->rotation, pose->translation, PoseStatus::ok};
}

/// A sample with the names of its tools.
struct Sample {
    std::shared_ptr<const Recording> recording;
    std::size_t index = 0;
    const TrackerSample& sample() const { return recording->samples[index]; }
};

/// A frame without its displacement, and the body whose buffer holds that.
struct PyFrame {
    FrameState state;
    std::vector<std::string> targets;
    py::array displacement;
};

/// The live body of a scene with a section `track`.
class PyTrackedBody : public Closable {
  public:
    PyTrackedBody(const PyScene& scene, std::optional<std::vector<std::string>> tools,
                  const py::object& progress)
        : scene_(scene.scene) {
        if (!scene_.track)
            fail(
                "{}: track is missing, expected the tracker's source and registration (livetet "
                "scene lists its keys)",
                scene.source);
        this->tools = tools ? std::move(*tools) : tools_of(*scene_.track);
        Watch watch(progress);
        in_engine([&] {
            try {
                make(watch);
            } catch (...) {
                tracked_.reset();  // here, with the engine's lock
                model_.reset();
                throw;
            }
        });
        sample_.poses.resize(this->tools.size());
    }
    ~PyTrackedBody() override {
        destroy_in_engine([this] { close(); });
    }
    void close() noexcept override {
        if (!tracked_) return;
        last_ = std::move(*tracked_).take_frame();  // views of its displacement stay valid
        tracked_.reset();
        model_->body.body.reset();
    }
    Mesh mesh() const { return {model_, model_->body.mesh()}; }

    PyFrame step(const py::object& self, const TrackerSample& sample,
                 std::optional<double> budget_ms) {
        FrameLimits limits;
        limits.deadline = deadline_of(Clock::now(), budget_ms);
        const Frame* frame = nullptr;
        in_engine([&] {
            if (!tracked_) fail("TrackedBody: is closed, expected steps before close()");
            if (has_work_) tracked_->work_on_responses();
            frame = &tracked_->advance(sample, limits);
            has_work_ = true;
        });
        return {*frame, tracked_->target_names(), view(frame->displacement, self)};
    }
    /// A sample of poses by tool.
    const TrackerSample& sample_of(const py::dict& poses, double time_s) {
        if (!std::isfinite(time_s)) fail("time: found {}, expected a finite number of s", time_s);
        sample_.time_s = time_s;
        std::size_t used = 0;
        for (std::size_t i = 0; i < tools.size(); ++i) {
            const py::str name(tools[i]);
            sample_.poses[i] = {};
            if (!poses.contains(name)) continue;
            ++used;
            sample_.poses[i] = pose_of_python(poses[name], tools[i]);
        }
        if (used != poses.size())
            for (const auto& entry : poses)
                if (const auto name = entry.first.cast<std::string>();
                    std::find(tools.begin(), tools.end(), name) == tools.end())
                    fail("poses: no tool {}, expected some of {}", name, fmt::join(tools, ", "));
        return sample_;
    }
    bool work_on_responses() {
        return in_engine([&] {
            has_work_ = false;
            return tracked_ && tracked_->work_on_responses();
        });
    }

    std::vector<std::string> tools;  ///< in the order of the samples' poses

  private:
    void make(Watch& watch) {
        if (has_blades(*scene_.track))
            fail(
                "track.tools: blade_mm, or track.cut_by_hand_mm: the body of Python is not cut "
                "while it is tracked, expected neither (`livetet track` follows blades)");
        const SceneOptions options(scene_.solver.petsc_options);
        const FiducialRegistration registration = read_registration(scene_.track->registration);
        const auto image_from_reference = rigid_registration(registration, *scene_.track);
        model_ = std::make_shared<TrackedModel>(
            make_tracked_model(scene_, load_mesh(scene_, watch.callback())));
        tracked_.emplace(track_model(scene_, *model_, tool_finder(tools), image_from_reference,
                                     registration.expected_error, MisplacedSensor::wait,
                                     SurfaceErrors::left_out));
    }

    Scene scene_;
    std::shared_ptr<TrackedModel> model_;
    std::optional<TrackedBody> tracked_;
    Frame last_;
    TrackerSample sample_;
    bool has_work_ = false;
};

py::list sensors_of(const PyFrame& frame) {
    py::list list;
    for (const SensorState& sensor : frame.state.sensors) {
        py::dict one;
        one["drive"] = drives[static_cast<std::size_t>(sensor.drive)];
        one["trouble"] = troubles[static_cast<std::size_t>(sensor.trouble)];
        one["press"] = sensor.press;
        one["off_organ"] = sensor.off_organ;
        list.append(one);
    }
    return list;
}

void bind_frame(py::module_& module) {
    py::class_<PyFrame>(module, "Frame", "Result of a step of the tracked body.")
        .def_readonly("displacement", &PyFrame::displacement,
                      "Of each node (n, 3), m: a view of the body's own numbers, which the next "
                      "step overwrites; copy() keeps it.")
        .def_property_readonly(
            "seconds",
            [](const PyFrame& f) {
                return f.state.sensor_s + f.state.step.seconds() + f.state.output_s +
                       f.state.statement_s;
            },
            "Time that the engine took for it.")
        .def_property_readonly(
            "time", [](const PyFrame& f) { return f.state.time_s; }, "s")
        .def_property_readonly(
            "report", [](const PyFrame& f) { return f.state.step; },
            "Iterations, convergence, estimate of the solver's error.")
        .def_property_readonly(
            "turned_elements", [](const PyFrame& f) { return f.state.turned_elements; },
            "Elements that the displacement turned over when they were last looked at (2048 a "
            "step): near them it means nothing.")
        .def_property_readonly(
            "press", [](const PyFrame& f) { return f.state.press; },
            "Displacement of the most displaced sensor, m.")
        .def_property_readonly(
            "registration",
            [](const PyFrame& f) {
                return registrations[static_cast<std::size_t>(f.state.registration)];
            },
            "'valid', 'held' (the reference is not seen, for a short time) or 'lost'.")
        .def_property_readonly(
            "tracker_from_image",
            [](const PyFrame& f) {
                return matrix4(f.state.tracker_from_image.rotation,
                               f.state.tracker_from_image.translation);
            },
            "4 x 4, m; NaN until the reference was seen. A copy.")
        .def_property_readonly("sensors", &sensors_of,
                               "Of each sensor of the scene: `drive` ('following', ...), `trouble` "
                               "('none', 'lost', ...), `press`, m, and `off_organ`, m.")
        .def_property_readonly(
            "targets", [](const PyFrame& f) { return dict_of(f.state.statement, f.targets); },
            "Stated errors by target, as Result.targets.");
}

void bind_recording(py::module_& module) {
    py::class_<Sample>(module, "Sample", "Poses of all tools at one time.")
        .def_property_readonly(
            "time", [](const Sample& s) { return s.sample().time_s; }, "s")
        .def_property_readonly(
            "poses",
            [](const Sample& s) {
                py::dict poses;
                for (std::size_t i = 0; i < s.sample().poses.size(); ++i) {
                    const TrackedPose& pose = s.sample().poses[i];
                    poses[py::str(s.recording->tools[i])] =
                        pose.status == PoseStatus::ok
                            ? py::object(matrix4(pose.rotation, pose.translation))
                            : py::object(py::none());
                }
                return poses;
            },
            "tracker_from_tool by tool: 4 x 4, m, or None where there is no valid pose. A copy.");
    using Shared = std::shared_ptr<Recording>;
    py::class_<Recording, Shared>(module, "Recording", "A recording of a tracker.")
        .def_static(
            "load",
            [](const py::object& path) {
                const std::string file = path_of(path);
                const py::gil_scoped_release release;
                return std::make_shared<Recording>(read_stored(file).recording);
            },
            py::arg("path"),
            "Reads a PLUS sequence file, or runs the script (.yaml) of a simulated tracker.")
        .def_property_readonly(
            "tools", [](const Recording& r) { return r.tools; }, "Names of the tools.")
        .def("__len__", [](const Recording& r) { return r.samples.size(); })
        .def(
            "__getitem__",
            [](const Shared& r, py::ssize_t k) {
                const auto count = std::ssize(r->samples);
                if (k < -count || k >= count) throw py::index_error("recording: no such sample");
                return Sample{r, static_cast<std::size_t>(k < 0 ? k + count : k)};
            },
            py::arg("index"), "A sample.");
}

}  // namespace

void bind_tracked_body(py::module_& module) {
    bind_frame(module);
    bind_recording(module);
    py::class_<PyTrackedBody>(module, "TrackedBody",
                              "The body that `livetet track` moves, one step a sample. Use it from "
                              "one thread.")
        .def(py::init([](const PyScene& scene, std::optional<std::vector<std::string>> tools,
                         const py::object& progress) {
                 return std::make_unique<PyTrackedBody>(scene, std::move(tools), progress);
             }),
             py::arg("scene"), py::arg("tools") = py::none(), py::arg("progress") = py::none(),
             "Of a scene with a section `track`; its registration is read, its source is not. "
             "tools: names of the tools of recorded samples; None: those of the scene.")
        .def_property_readonly("mesh", &PyTrackedBody::mesh, "The finest mesh.")
        .def_readonly("tools", &PyTrackedBody::tools, "Names of the tools.")
        .def(
            "step",
            [](const py::object& self, const py::dict& poses, double time,
               std::optional<double> budget_ms) {
                auto& body = self.cast<PyTrackedBody&>();
                return body.step(self, body.sample_of(poses, time), budget_ms);
            },
            py::arg("poses"), py::arg("time"), py::arg("budget_ms") = py::none(),
            "A frame from poses by tool: tracker_from_tool, 4 x 4, m; None or left out: not seen. "
            "A matrix that is not rigid counts as broken. time: of the sample, s, increasing. "
            "budget_ms: ends the linear solve so as to meet it.")
        .def(
            "step",
            [](const py::object& self, const Sample& sample, std::optional<double> budget_ms) {
                return self.cast<PyTrackedBody&>().step(self, sample.sample(), budget_ms);
            },
            py::arg("sample"), py::arg("budget_ms") = py::none(),
            "A frame from a recorded sample, whose tools must be those of the body, in order.")
        .def("work_on_responses", &PyTrackedBody::work_on_responses,
             "In idle time after a step: a part of the solves that stated errors need. If it is "
             "not called, the next step begins with it. Returns False if nothing is left to do.")
        .def(
            "close", [](PyTrackedBody& body) { destroy_in_engine([&body] { body.close(); }); },
            "Frees the solver's memory now; arrays and mesh stay.");
}

}  // namespace livetet::python
