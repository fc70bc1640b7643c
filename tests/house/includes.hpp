#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "house/source_tree.hpp"

namespace livetet::house {

/// For every folder the folders whose headers it may include, itself among them.
using Arrows = std::map<std::string, std::set<std::string>>;

/// The arrows of src, solvers, io, meshing and apps. Those between the folders of apps/ are what
/// `apps_cmake`, the text of apps/CMakeLists.txt, links (the LINKS of its libraries, and theirs).
/// Throws std::runtime_error if a folder links one that is not listed before it.
Arrows arrows(const std::string& apps_cmake);

/// Every include of `files` that no arrow allows, and every use of PETSc or MPI under src outside
/// of base/petsc.hpp.
std::vector<std::string> wrong_includes(const SourceFiles& files, const Arrows& arrows);

/// Every include of `files` of tests/, examples/ and benchmarks/ that they may not have: a test
/// includes what it tests and what that may include; an example installed headers alone.
std::vector<std::string> wrong_includes_of_users(const SourceFiles& files);

/// Every circle of files that include each other, told once.
std::vector<std::string> include_circles(const SourceFiles& files);

}  // namespace livetet::house
