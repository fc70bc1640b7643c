#include <pybind11/stl.h>

#include <optional>

#include "apps/live/statement_record.hpp"
#include "apps/python/arrays.hpp"
#include "apps/python/engine.hpp"
#include "apps/python/scene.hpp"
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
    py::class_<Result>(module, "Result",
                       "A result file of `livetet solve` or `livetet track`. Each call reads the "
                       "file and returns arrays of its own.")
        .def(py::init(&open), py::arg("path"), "Opens and checks the file.")
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
}

}  // namespace livetet::python
