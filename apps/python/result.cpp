#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "apps/live/statement_record.hpp"
#include "apps/python/arrays.hpp"
#include "apps/python/engine.hpp"
#include "apps/python/scene.hpp"
#include "apps/warp/warp_results.hpp"
#include "config/yaml.hpp"
#include "io/result_file.hpp"

namespace livetet::python {

namespace {

/// A result file. HDF5 is used under the engine's lock.
struct Result {
    std::shared_ptr<const ResultReader> reader;
    std::string file;
    std::optional<StatementReader> statements;
};

Result open(const py::object& path) {
    const std::string file = path_of(path);
    return in_engine([&] {
        auto reader = std::make_shared<const ResultReader>(file);
        Result result{reader, file, {}};
        result.statements.emplace(*reader, file);
        return result;
    });
}

/// The index of frame k; negative ones count from the end. Throws IndexError.
std::size_t frame_of(const Result& result, py::ssize_t k) {
    const auto count = static_cast<py::ssize_t>(result.reader->frame_count());
    if (k < -count || k >= count)
        throw py::index_error(fmt::format("{}: found frame {}, expected {} to {}", result.file, k,
                                          -count, count - 1));
    return static_cast<std::size_t>(k < 0 ? k + count : k);
}

/// Components of the fields that `output.fields` names.
int components_of(const std::string& field) {
    return field == "stress" ? 9 : field == "reactions" ? 3 : 1;
}

py::array field(const Result& result, const std::string& name, py::ssize_t k) {
    const std::vector<std::string> names = in_engine([&] { return result.reader->field_names(); });
    if (std::find(names.begin(), names.end(), name) == names.end())
        fail("{}: no field {}, expected {}", result.file, name,
             names.empty() ? "none: the scene asked for none (output.fields)"
                           : fmt::format("one of {}", fmt::join(names, ", ")));
    const int components = components_of(name);
    const std::size_t frame = frame_of(result, k);
    std::vector<double> values =
        in_engine([&] { return result.reader->field(name, frame, components); });
    std::vector<py::ssize_t> shape{std::ssize(values) / components};
    if (components == 3) shape.push_back(3);
    if (components == 9) shape.insert(shape.end(), {3, 3});
    return owned(std::move(values), std::move(shape));
}

/// What ran: the description of `solve` or `track`.
py::object info(const Result& result) {
    const auto text = in_engine([&]() -> std::optional<std::string> {
        for (const char* name : {"solve", "run"})
            if (result.reader->has_text(name)) return result.reader->text(name);
        return {};
    });
    return text ? python_of_json(*text) : py::dict();
}

py::dict targets(const Result& result, py::ssize_t k) {
    const std::size_t frame = frame_of(result, k);
    return dict_of(in_engine([&] { return result.statements->read(frame); }),
                   result.statements->names());
}

/// A file of a warp: a path, or empty for None. Throws Error, naming it, for an empty text.
std::filesystem::path optional_path(const py::object& path, const char* name) {
    if (path.is_none()) return {};
    const std::string text = path_of(path);
    if (text.empty()) fail("{}: found an empty text, expected a path or None", name);
    return text;
}

std::optional<Interpolation> interpolation_of(const std::optional<std::string>& name) {
    if (!name) return {};
    const auto at = interpolations.find(*name);
    if (at == interpolations.end())
        fail("interpolation: found \"{}\", expected nearest, linear or cubic", *name);
    return at->second;
}

/// Warps `frames`, counted from 0, as the other arguments say. Returns the figures of each.
py::list warp_frames(const Result& result, WarpArguments arguments,
                     const std::vector<py::ssize_t>& frames, const py::object& progress) {
    std::vector<std::size_t> numbers;
    for (const py::ssize_t k : frames) numbers.push_back(frame_of(result, k) + 1);
    if (numbers.empty()) fail("frame: found none, expected at least one");
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (std::find(numbers.begin(), numbers.begin() + static_cast<std::ptrdiff_t>(i),
                      numbers[i]) != numbers.begin() + static_cast<std::ptrdiff_t>(i))
            fail("frame: found {} twice, expected each frame once", numbers[i] - 1);
    arguments.frames = fmt::format("{}", fmt::join(numbers, ","));
    Watch watch(progress);
    const auto warped = in_engine([&] { return warp_results(arguments, watch.callback()); });
    py::list figures;
    for (std::size_t n = 0; n < warped.size(); ++n) {
        py::dict one = python_of_json(
            warped[n].figures.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
        one["frame"] = numbers[n] - 1;  // as everywhere in Python
        figures.append(one);
    }
    return figures;
}

py::object warp(const Result& result, const py::object& output,
                const std::variant<py::ssize_t, std::vector<py::ssize_t>>& frame,
                const py::object& image, const py::object& grid, const py::object& inverse_field,
                const py::object& forward_field, const py::object& registration,
                const std::optional<std::string>& interpolation, std::optional<double> empty,
                std::optional<double> rind_mm, int threads, const py::object& progress) {
    if (rind_mm && !(*rind_mm >= 0 && *rind_mm <= max_rind_mm))
        fail("rind_mm: found {}, expected 0 to {:g}", *rind_mm, max_rind_mm);
    if (empty && !std::isfinite(*empty)) fail("empty: found {}, expected a finite number", *empty);
    if (output.is_none() && inverse_field.is_none() && forward_field.is_none() &&
        registration.is_none())
        fail(
            "warp: found no file to write, expected output, inverse_field, forward_field or "
            "registration");
    if (threads < 0 || threads > 64) fail("threads: found {}, expected 0 to 64", threads);
    WarpArguments a;
    a.results = {result.file};
    a.output = optional_path(output, "output");
    a.image = optional_path(image, "image");
    a.grid = optional_path(grid, "grid");
    a.inverse_field = optional_path(inverse_field, "inverse_field");
    a.forward_field = optional_path(forward_field, "forward_field");
    a.registration = optional_path(registration, "registration");
    a.interpolation = interpolation_of(interpolation);
    a.empty = empty;
    a.rind_mm = rind_mm;
    a.threads = threads;
    if (const auto* one = std::get_if<py::ssize_t>(&frame))
        return warp_frames(result, a, {*one}, progress)[0];
    return warp_frames(result, a, std::get<1>(frame), progress);
}

void bind_warp(py::class_<Result>& result) {
    result.def(
        "warp", &warp, py::arg("output") = py::none(), py::kw_only(), py::arg("frame") = -1,
        py::arg("image") = py::none(), py::arg("grid") = py::none(),
        py::arg("inverse_field") = py::none(), py::arg("forward_field") = py::none(),
        py::arg("registration") = py::none(), py::arg("interpolation") = py::none(),
        py::arg("empty") = py::none(), py::arg("rind_mm") = py::none(), py::arg("threads") = 0,
        py::arg("progress") = py::none(),
        "`livetet warp`: writes the image that was meshed, or `image`, in the deformed state of a "
        "frame, to `output`: NIfTI, or a folder for a DICOM series. `inverse_field`, "
        "`forward_field` (NIfTI) and `registration` (DICOM) are written where they are named. "
        "Returns the figures of the frame, a dict; of several frames, whose files have {frame} in "
        "their names, a list.");
}

}  // namespace

py::dict dict_of(const FrameStatement& statement, const std::vector<std::string>& names) {
    py::dict dict;
    for (std::size_t i = 0; i < statement.targets.size(); ++i) {
        const TargetStatement& target = statement.targets[i];
        py::dict by_source;
        for (std::size_t s = 0; s < error_source_count; ++s)
            by_source[name_of(static_cast<ErrorSource>(s))] = target.by_source[s];
        py::dict one;
        one["position"] = vector(target.position);
        one["radius_95"] = target.radius_95;
        one["covariance"] = matrix(target.covariance);
        one["by_source"] = by_source;
        dict[py::str(names.at(i))] = one;
    }
    return dict;
}

void bind_result(py::module_& module) {
    py::class_<Result> result(
        module, "Result",
        "A result file of `livetet solve` or `livetet track`. Each call reads the "
        "file and returns arrays of its own.");
    result.def(py::init(&open), py::arg("path"), "Opens and checks the file.")
        .def("__len__", [](const Result& r) { return r.reader->frame_count(); })
        .def_property_readonly(
            "mesh", [](const Result& r) { return Mesh(r.reader, r.reader->mesh()); },
            "The mesh at rest.")
        .def_property_readonly(
            "times",
            [](const py::object& self) {
                const auto& times = self.cast<const Result&>().reader->times_s();
                return view(times.data(), {std::ssize(times)}, self);
            },
            "Time of each frame, s; of a static solve the share of its load. A view.")
        .def(
            "displacement",
            [](const Result& r, py::ssize_t k) {
                const std::size_t frame = frame_of(r, k);
                return owned(in_engine([&] { return r.reader->displacement(frame); }));
            },
            py::arg("frame"), "Of each node (n, 3), m, in a frame; -1 is the last.")
        .def_property_readonly(
            "fields",
            [](const Result& r) { return in_engine([&] { return r.reader->field_names(); }); },
            "Names of the fields beside the displacement (output.fields).")
        .def("field", &field, py::arg("name"), py::arg("frame"),
             "A field of a frame: one number, (3,) or (3, 3) for each tet or node.")
        .def_property_readonly("info", &info, "What ran, with its figures: a dict.")
        .def_property_readonly(
            "scene",
            [](const Result& r) {
                return PyScene{read_yaml<Scene>(r.reader->scene_text(), r.file), r.file};
            },
            "The scene that ran.")
        .def_property_readonly(
            "target_names", [](const Result& r) { return r.statements->names(); },
            "Targets whose errors `track` stated.")
        .def("targets", &targets, py::arg("frame"),
             "Stated errors in a frame, by target: `position` (3,), m, as shown; `radius_95`, m, "
             "within which it is with 95 %; `covariance` (3, 3), m^2; `by_source`, m^2.");
    bind_warp(result);
}

}  // namespace livetet::python
