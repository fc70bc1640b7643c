#pragma once

#include <vector>

#include "apps/live/error_statement.hpp"
#include "apps/python/mesh.hpp"
#include "apps/scene/scene.hpp"

namespace livetet::python {

/// A checked scene.
struct PyScene {
    Scene scene;
    std::string source;  ///< for messages
};

/// A YAML text as dicts, lists, numbers and texts.
py::object python_of_yaml(const std::string& text);
/// A JSON text likewise.
py::object python_of_json(const std::string& text);

/// Stated errors by target, see Result.targets.
py::dict dict_of(const FrameStatement& statement, const std::vector<std::string>& names);

}  // namespace livetet::python
