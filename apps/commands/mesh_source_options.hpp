#pragma once

#include <CLI/CLI.hpp>

#include "apps/scene/mesh_source.hpp"

namespace livetet {

/// Adds an option to `command` for each key of a scene's mesh block that has one (see MeshKey),
/// with the key's text and check. `source` takes the values, and must live as long as the command.
void add_source_options(CLI::App& command, MeshSource& source);

}  // namespace livetet
