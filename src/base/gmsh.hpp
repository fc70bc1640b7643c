#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// The functions of Gmsh that Livetet calls. The first call, or load(), loads the library, which is
/// linked with OpenCASCADE and FLTK: programs that neither mesh nor read `.msh` files start without
/// them.
///
/// Functions throw Error if the library cannot be loaded, and std::runtime_error with Gmsh's last
/// message if the call fails. Gmsh has one state for the process and is not thread-safe.
namespace livetet::gmsh {

/// Dimension and tag of an entity or a physical group.
using DimTag = std::pair<int, int>;
using Tags = std::vector<std::size_t>;

/// Loads the library. To be called before a fork, so that children need not load it again.
void load();
/// Version of the interface that this program was compiled for.
std::string api_version();

/// Starts without command line and without the user's configuration files.
void initialize();
void set_number(const char* option, double value);
/// Reads a file into a new model.
void open(const std::filesystem::path& path);
void start_log();
/// The lines that were logged from start_log() on.
std::vector<std::string> log();

// The current model.
void add_model(const char* name);
/// All entities or physical groups of a dimension; -1: of all.
std::vector<DimTag> entities(int dimension);
std::vector<DimTag> physical_groups(int dimension);
std::vector<int> physical_groups_of_entity(int dimension, int entity);
std::vector<int> entities_of_physical_group(int dimension, int group);
/// Empty if the group has no name.
std::string physical_name(int dimension, int group);
void add_discrete_entity(int dimension, int tag);
/// Returns the tag of the loop.
int add_surface_loop(int surface);
/// The first loop is the outer one, the others are holes.
void add_volume(std::vector<int> loops, int tag);
void synchronize();

// Its mesh.
struct Nodes {
    Tags tags;
    std::vector<double> coordinates;  ///< x, y, z of each node
};
/// One type of elements: node tags of one element after another.
struct Elements {
    int type = 0;
    Tags nodes;
};
struct ElementType {
    std::string name;
    int order = 0;
    std::vector<double> places;  ///< of its nodes in the reference element, one after the other
};

/// Nodes of all entities, each once.
Nodes nodes();
Tags nodes_of_physical_group(int dimension, int group);
std::vector<Elements> elements(int dimension, int entity);
/// Node tags of all elements of a type, one element after another.
Tags elements_of_type(int type);
ElementType element_type(int type);
void add_nodes(int dimension, int entity, const Nodes& nodes);
/// Adds elements with the next free tags.
void add_elements(int entity, const Elements& elements);
/// Sets the edge length that generate() aims at, in place of an earlier one. An exception of `size`
/// ends generate(), which throws it.
void set_size_callback(std::function<double(double x, double y, double z)> size);
void generate(int dimension);
/// One pass of the optimiser of tetrahedra.
void optimize();

}  // namespace livetet::gmsh
