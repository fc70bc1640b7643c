#include "base/gmsh.hpp"

#include <gmsh.h>
#include <gmshc.h>

#include <exception>
#include <stdexcept>
#include <type_traits>

#include "base/shared_library.hpp"

namespace livetet::gmsh {

namespace {

/// What Gmsh takes for every dimension or tag, and for a tag that it is to choose.
constexpr int all = -1, next_free = -1;

/// LIVETET_GMSH_LIBRARY is the library that the build found.
const SharedLibrary& library() {
    static const SharedLibrary loaded("Gmsh", LIVETET_GMSH_LIBRARY);
    return loaded;
}

template <class F>
F* function(const char* name) {
    return library().function<F>(name);
}

void release(void* memory) { function<decltype(gmshFree)>("gmshFree")(memory); }

/// An array that Gmsh allocated.
template <class T>
struct Array {
    T* data = nullptr;
    std::size_t size = 0;

    Array() = default;
    Array(const Array&) = delete;
    Array& operator=(const Array&) = delete;
    ~Array() {
        if (data) release(data);
    }
    std::vector<T> copy() const { return {data, data + size}; }
};

/// An array of arrays, each of T, that Gmsh allocated.
template <class T>
struct Arrays {
    T** data = nullptr;
    std::size_t* sizes = nullptr;
    std::size_t size = 0, size_of_sizes = 0;

    Arrays() = default;
    Arrays(const Arrays&) = delete;
    Arrays& operator=(const Arrays&) = delete;
    ~Arrays() {
        for (std::size_t i = 0; i < size; ++i) release(data[i]);
        if (data) release(data);
        if (sizes) release(sizes);
    }
};

struct Text {
    char* data = nullptr;

    Text() = default;
    Text(const Text&) = delete;
    Text& operator=(const Text&) = delete;
    ~Text() {
        if (data) release(data);
    }
    std::string copy() const { return data ? data : ""; }
};

std::string last_error() {
    Text text;
    int failed = 0;
    function<decltype(gmshLoggerGetLastError)>("gmshLoggerGetLastError")(&text.data, &failed);
    return text.copy();
}

std::function<double(double, double, double)> size_at;
std::exception_ptr thrown_by_size;

/// The exception ends the meshing: Gmsh's C interface catches it, without its text.
double size_from_gmsh(int, int, double x, double y, double z, void*) {
    try {
        return size_at(x, y, z);
    } catch (...) {
        thrown_by_size = std::current_exception();
        throw;
    }
}

/// Throws if a call failed, or if the callback for sizes did so in it.
void check(const char* name, int failed) {
    if (thrown_by_size) std::rethrow_exception(std::exchange(thrown_by_size, nullptr));
    if (!failed) return;
    const std::string reason = last_error();
    throw std::runtime_error(std::string(name) + ": " + (reason.empty() ? "it failed" : reason));
}

/// Calls the function `name` of Gmsh, of type F, whose last argument is the place of a status.
template <class F, class... Arguments>
auto call(const char* name, Arguments... arguments) {
    F* const f = function<F>(name);
    int failed = 0;
    if constexpr (std::is_void_v<std::invoke_result_t<F*, Arguments..., int*>>) {
        f(arguments..., &failed);
        check(name, failed);
    } else {
        const auto result = f(arguments..., &failed);
        check(name, failed);
        return result;
    }
}

/// The function's name gives both its type and its symbol.
#define LIVETET_GMSH(name, ...) call<decltype(name)>(#name __VA_OPT__(, ) __VA_ARGS__)

/// Calls the function `symbol` of Gmsh's C++ interface, of type F. `name`: in messages.
template <class F, class... Arguments>
void call_cpp(const char* name, const char* symbol, const Arguments&... arguments) {
    F* const f = function<F>(symbol);
    try {
        f(arguments...);
    } catch (const std::exception&) {
        throw;
    } catch (...) {  // Gmsh 4.8 also throws int and std::string
        check(name, 1);
    }
}

std::vector<DimTag> pairs(const Array<int>& flat) {
    std::vector<DimTag> found;
    for (std::size_t i = 0; i + 1 < flat.size; i += 2)
        found.emplace_back(flat.data[i], flat.data[i + 1]);
    return found;
}

}  // namespace

void load() { (void)library(); }

std::string api_version() { return GMSH_API_VERSION; }

void initialize() {
    constexpr int without_files = 0;
    LIVETET_GMSH(gmshInitialize, 0, nullptr, without_files);
}

void set_number(const char* option, double value) {
    LIVETET_GMSH(gmshOptionSetNumber, option, value);
}

void open(const std::filesystem::path& path) { LIVETET_GMSH(gmshOpen, path.c_str()); }

void start_log() { LIVETET_GMSH(gmshLoggerStart); }

std::vector<std::string> log() {
    Array<char*> lines;
    LIVETET_GMSH(gmshLoggerGet, &lines.data, &lines.size);
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < lines.size; ++i) {
        texts.emplace_back(lines.data[i]);
        release(lines.data[i]);
    }
    return texts;
}

void add_model(const char* name) { LIVETET_GMSH(gmshModelAdd, name); }

std::vector<DimTag> entities(int dimension) {
    Array<int> flat;
    LIVETET_GMSH(gmshModelGetEntities, &flat.data, &flat.size, dimension);
    return pairs(flat);
}

std::vector<DimTag> physical_groups(int dimension) {
    Array<int> flat;
    LIVETET_GMSH(gmshModelGetPhysicalGroups, &flat.data, &flat.size, dimension);
    return pairs(flat);
}

std::vector<int> physical_groups_of_entity(int dimension, int entity) {
    Array<int> tags;
    LIVETET_GMSH(gmshModelGetPhysicalGroupsForEntity, dimension, entity, &tags.data, &tags.size);
    return tags.copy();
}

std::vector<int> entities_of_physical_group(int dimension, int group) {
    Array<int> tags;
    LIVETET_GMSH(gmshModelGetEntitiesForPhysicalGroup, dimension, group, &tags.data, &tags.size);
    return tags.copy();
}

std::string physical_name(int dimension, int group) {
    Text name;
    LIVETET_GMSH(gmshModelGetPhysicalName, dimension, group, &name.data);
    return name.copy();
}

void add_discrete_entity(int dimension, int tag) {
    LIVETET_GMSH(gmshModelAddDiscreteEntity, dimension, tag, nullptr, 0);
}

int add_surface_loop(int surface) {
    return LIVETET_GMSH(gmshModelGeoAddSurfaceLoop, &surface, 1, next_free);
}

void add_volume(std::vector<int> loops, int tag) {
    LIVETET_GMSH(gmshModelGeoAddVolume, loops.data(), loops.size(), tag);
}

void synchronize() { LIVETET_GMSH(gmshModelGeoSynchronize); }

Nodes nodes() {
    constexpr int of_boundary = 0, parameters = 0;
    Array<std::size_t> tags;
    Array<double> places, unused;
    LIVETET_GMSH(gmshModelMeshGetNodes, &tags.data, &tags.size, &places.data, &places.size,
                 &unused.data, &unused.size, all, all, of_boundary, parameters);
    return {tags.copy(), places.copy()};
}

Tags nodes_of_physical_group(int dimension, int group) {
    Array<std::size_t> tags;
    Array<double> places;
    LIVETET_GMSH(gmshModelMeshGetNodesForPhysicalGroup, dimension, group, &tags.data, &tags.size,
                 &places.data, &places.size);
    return tags.copy();
}

std::vector<Elements> elements(int dimension, int entity) {
    Array<int> types;
    Arrays<std::size_t> tags, corners;
    LIVETET_GMSH(gmshModelMeshGetElements, &types.data, &types.size, &tags.data, &tags.sizes,
                 &tags.size, &corners.data, &corners.sizes, &corners.size, dimension, entity);
    std::vector<Elements> found;
    for (std::size_t i = 0; i < types.size; ++i)
        found.push_back({types.data[i], Tags(corners.data[i], corners.data[i] + corners.sizes[i])});
    return found;
}

Tags elements_of_type(int type) {
    Array<std::size_t> tags, corners;
    LIVETET_GMSH(gmshModelMeshGetElementsByType, type, &tags.data, &tags.size, &corners.data,
                 &corners.size, all, 0, 1);
    return corners.copy();
}

ElementType element_type(int type) {
    Text name;
    Array<double> places;
    int dimension = 0, order = 0, nodes = 0, primary = 0;
    LIVETET_GMSH(gmshModelMeshGetElementProperties, type, &name.data, &dimension, &order, &nodes,
                 &places.data, &places.size, &primary);
    return {name.copy(), order, {places.data, places.data + places.size}};
}

// HXT's mesh depends on the order of memory addresses, and the C interface copies the arrays that
// it is given. The C++ functions copy none: a surface keeps the mesh that it had when Livetet was
// linked with Gmsh.

void add_nodes(int dimension, int entity, const Nodes& nodes) {
    call_cpp<decltype(::gmsh::model::mesh::addNodes)>(
        "gmsh::model::mesh::addNodes",
        "_ZN4gmsh5model4mesh8addNodesEiiRKSt6vectorImSaImEERKS2_IdSaIdEESA_", dimension, entity,
        nodes.tags, nodes.coordinates, std::vector<double>());
}

void add_elements(int entity, const Elements& elements) {
    call_cpp<decltype(::gmsh::model::mesh::addElementsByType)>(
        "gmsh::model::mesh::addElementsByType",
        "_ZN4gmsh5model4mesh17addElementsByTypeEiiRKSt6vectorImSaImEES6_", entity, elements.type,
        Tags(), elements.nodes);
}

void set_size_callback(std::function<double(double, double, double)> size) {
    size_at = std::move(size);
    LIVETET_GMSH(gmshModelMeshSetSizeCallback, &size_from_gmsh, nullptr);
}

void generate(int dimension) { LIVETET_GMSH(gmshModelMeshGenerate, dimension); }

void optimize() {
    constexpr const char* of_tetrahedra = "";
    constexpr int discrete_too = 0, passes = 1;
    LIVETET_GMSH(gmshModelMeshOptimize, of_tetrahedra, discrete_too, passes, nullptr, 0);
}

}  // namespace livetet::gmsh
