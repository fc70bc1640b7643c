#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <utility>

#include "mesh/hierarchy.hpp"

namespace livetet::python {

namespace py = pybind11;

/// A mesh for Python: a level of a hierarchy, or one without coarser meshes.
struct Mesh {
    std::shared_ptr<const TetMesh> mesh;
    std::shared_ptr<const MeshHierarchy> hierarchy;  ///< null: none

    explicit Mesh(TetMesh one) : mesh(std::make_shared<const TetMesh>(std::move(one))) {}
    explicit Mesh(std::shared_ptr<const MeshHierarchy> levels, std::size_t level = 0)
        : mesh(levels, &levels->levels.at(level)), hierarchy(std::move(levels)) {}
    /// `kept` keeps `one` alive.
    Mesh(std::shared_ptr<const void> kept, const TetMesh& one) : mesh(std::move(kept), &one) {}
};

/// A text as it is, or a dict as JSON, which is YAML too.
std::string yaml_text_of(const py::object& text_or_dict);
/// The path as text: of a str or a path-like object.
std::string path_of(const py::object& path);

void bind_mesh(py::module_& module);
void bind_scene(py::module_& module);
void bind_result(py::module_& module);
void bind_body(py::module_& module);
void bind_tracked_body(py::module_& module);
void bind_registration(py::module_& module);

}  // namespace livetet::python
