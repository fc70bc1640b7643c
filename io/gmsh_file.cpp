#include "io/gmsh_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/gmsh.hpp"
#include "io/parse_in_child.hpp"
#include "io/text.hpp"
#include "mesh/mesh_of_hexahedra.hpp"
#include "mesh/packed_mesh.hpp"
#include "mesh/quadratic_hexahedra.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using gmsh::Tags;

constexpr int triangle_type = 2, tet_type = 4;
/// Of 8, 20 and 27 nodes.
constexpr int hexahedron_types[] = {5, 17, 12};
/// Of 4, 8 and 9 nodes.
constexpr std::pair<int, std::size_t> quadrangle_types[] = {{3, 4}, {16, 8}, {10, 9}};

/// The first error that Gmsh logged; empty if there was none.
std::string first_error() {
    for (const std::string& line : gmsh::log())
        if (line.starts_with("Error")) return line;
    return {};
}

/// Checks the file before Gmsh reads it: Gmsh runs unknown files as scripts, and does not detect a
/// truncated one.
void check_is_whole_mesh(const fs::path& path) {
    const std::string text = read_text_file(path), where = path.string();
    const auto lines = split_lines(std::string_view(text).substr(0, 4096));
    if (lines.size() < 2 || trim(lines[0]) != "$MeshFormat")
        fail("{}:1: found '{}', expected $MeshFormat, as Gmsh's .msh files begin", where,
             lines.empty() ? "" : trim(lines[0]).substr(0, 40));
    const auto words = split_words(lines[1]);
    const auto version = words.empty() ? std::nullopt : parse_number(words[0]);
    if (!version || !(*version == 2.2 || (*version >= 4 && *version < 5)))
        fail("{}:2: found MSH version '{}', expected 2.2 or 4.1", where,
             words.empty() ? "" : words[0]);
    for (const char* section : {"Nodes", "Elements"}) {
        if (text.find(fmt::format("${}\n", section)) == std::string::npos &&
            text.find(fmt::format("${}\r", section)) == std::string::npos)
            fail("{}: holds no section ${}", where, section);
        if (text.find(fmt::format("$End{}", section)) == std::string::npos)
            fail("{}: its section ${} does not end: the file is truncated", where, section);
    }
}

/// Builds a mesh from Gmsh's current model.
class Reader {
  public:
    Reader(std::string where, double metres_per_unit)
        : where_(std::move(where)), unit_(metres_per_unit) {}

    TetMesh read() {
        read_places();
        if (const int type = hexahedron_type())
            read_hexahedra(type);
        else
            read_tets();
        for (const Triangle& t : boundary_triangles(mesh_.tets)) outwards_[sorted(t)] = t;
        for (const auto& [dimension, tag] : gmsh::physical_groups(-1))
            if (dimension < 3) read_group(dimension, tag);
        if (cells_.empty()) return std::move(mesh_);
        return mesh_of_hexahedra(std::move(mesh_), std::move(cells_), cell_regions_, where_);
    }

  private:
    static Triangle sorted(Triangle t) {
        std::sort(t.begin(), t.end());
        return t;
    }

    void read_places() {
        const auto [tags, coordinates] = gmsh::nodes();
        if (coordinates.size() != 3 * tags.size()) fail("{}: its nodes are malformed", where_);
        for (std::size_t i = 0; i < tags.size(); ++i)
            places_[tags[i]] =
                unit_ * Vector3(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]);
    }

    /// The mesh's index of a Gmsh node, assigned at its first use by a tet or hexahedron.
    std::int32_t number_of(std::size_t tag) {
        if (const auto known = numbers_.find(tag); known != numbers_.end()) return known->second;
        const auto place = places_.find(tag);
        if (place == places_.end())
            fail("{}: an element names node {}, which is not in the file", where_, tag);
        const auto number = static_cast<std::int32_t>(mesh_.nodes.size());
        mesh_.nodes.push_back(place->second);
        numbers_[tag] = number;
        return number;
    }

    /// The nodes of all elements of an entity. All elements must be of `type`.
    Tags elements_of(int dimension, int entity, int type, const std::string& expected) {
        Tags all;
        for (const gmsh::Elements& elements : gmsh::elements(dimension, entity)) {
            if (elements.type != type) {
                const gmsh::ElementType found = gmsh::element_type(elements.type);
                fail(
                    "{}: entity {} of dimension {} holds elements of type {} (order {}), expected "
                    "{}",
                    where_, entity, dimension, found.name, found.order, expected);
            }
            all.insert(all.end(), elements.nodes.begin(), elements.nodes.end());
        }
        return all;
    }

    /// Gmsh's type of the file's hexahedra, or 0.
    static int hexahedron_type() {
        for (const auto& [dimension, entity] : gmsh::entities(3))
            for (const gmsh::Elements& elements : gmsh::elements(dimension, entity))
                if (std::ranges::find(hexahedron_types, elements.type) !=
                    std::end(hexahedron_types))
                    return elements.type;
        return 0;
    }

    void read_hexahedra(int type) {
        const bool grouped = !gmsh::physical_groups(3).empty();
        const gmsh::ElementType element = gmsh::element_type(type);
        std::vector<int> place_of;  // of each of Gmsh's nodes, from -1 to 1, in a cell of ours
        for (std::size_t i = 0; i + 2 < element.places.size(); i += 3) {
            const auto half = [&](std::size_t d) {
                return static_cast<int>(std::lround(element.places[i + d])) + 1;
            };
            place_of.push_back(quadratic_place(half(0), half(1), half(2)));
        }
        for (const auto& [dimension, entity] : gmsh::entities(3)) {
            const Tags nodes = elements_of(
                dimension, entity, type,
                fmt::format("hexahedra of {} nodes, as others are in this file", place_of.size()));
            const std::vector<int> physical = gmsh::physical_groups_of_entity(3, entity);
            for (std::size_t i = 0; i + place_of.size() <= nodes.size(); i += place_of.size()) {
                QuadraticHexahedron& cell = cells_.emplace_back();
                cell.fill(-1);
                for (std::size_t k = 0; k < place_of.size(); ++k)
                    cell[place_of[k]] = number_of(nodes[i + k]);
                if (grouped) cell_regions_.push_back(physical.empty() ? 0 : physical[0]);
            }
        }
    }

    void read_tets() {
        const bool grouped = !gmsh::physical_groups(3).empty();
        for (const auto& [dimension, entity] : gmsh::entities(3)) {
            const Tags nodes = elements_of(dimension, entity, tet_type, "4-node tetrahedra");
            const std::vector<int> physical = gmsh::physical_groups_of_entity(3, entity);
            for (std::size_t i = 0; i + 3 < nodes.size(); i += 4) {
                mesh_.tets.push_back({number_of(nodes[i]), number_of(nodes[i + 1]),
                                      number_of(nodes[i + 2]), number_of(nodes[i + 3])});
                if (grouped) mesh_.regions.push_back(physical.empty() ? 0 : physical[0]);
            }
        }
        check_tet_mesh(mesh_, where_);
    }

    static std::string name_of(int dimension, int tag) {
        const std::string name = gmsh::physical_name(dimension, tag);
        constexpr const char* kinds[] = {"point", "curve", "surface"};
        return name.empty() ? fmt::format("{}_{}", kinds[dimension], tag) : name;
    }

    void read_group(int dimension, int tag) {
        const std::string name = name_of(dimension, tag);
        auto& set = mesh_.node_sets[name];
        if (dimension == 2 && !cells_.empty()) read_quads(tag, mesh_.triangle_sets[name]);
        if (dimension == 2 && cells_.empty()) {
            auto& triangles = mesh_.triangle_sets[name];
            read_triangles(tag, triangles);
            const auto nodes = nodes_of(triangles);
            set.insert(set.end(), nodes.begin(), nodes.end());
        } else {
            for (const std::size_t node : gmsh::nodes_of_physical_group(dimension, tag))
                if (const auto known = numbers_.find(node); known != numbers_.end())
                    set.push_back(known->second);
        }
        std::sort(set.begin(), set.end());
        set.erase(std::unique(set.begin(), set.end()), set.end());
        if (set.empty())
            fail("{}: the group '{}' has no node of the body, expected it to lie on the body",
                 where_, name);
    }

    /// The mesh's numbers of the first nodes of an element; none if one is no node of the body.
    template <std::size_t count>
    std::optional<std::array<std::int32_t, count>> on_body(
        std::span<const std::size_t> nodes) const {
        std::array<std::int32_t, count> numbers{};
        for (std::size_t k = 0; k < count; ++k) {
            const auto known = numbers_.find(nodes[k]);
            if (known == numbers_.end()) return std::nullopt;
            numbers[k] = known->second;
        }
        return numbers;
    }

    /// Two triangles between the corners of each quadrangle of a group, of which those come first.
    void read_quads(int tag, std::vector<Triangle>& triangles) {
        for (const int entity : gmsh::entities_of_physical_group(2, tag))
            for (const gmsh::Elements& elements : gmsh::elements(2, entity)) {
                const auto type = std::ranges::find(quadrangle_types, elements.type,
                                                    &std::pair<int, std::size_t>::first);
                if (type == std::end(quadrangle_types)) continue;
                for (std::size_t i = 0; i + type->second <= elements.nodes.size();
                     i += type->second) {
                    const auto quad = on_body<4>(std::span(elements.nodes).subspan(i));
                    if (!quad) continue;
                    const auto [a, b, c, d] = *quad;
                    triangles.push_back({a, b, c});
                    triangles.push_back({a, c, d});
                }
            }
    }

    void read_triangles(int tag, std::vector<Triangle>& triangles) {
        for (const int entity : gmsh::entities_of_physical_group(2, tag)) {
            const Tags nodes = elements_of(2, entity, triangle_type, "3-node triangles");
            for (std::size_t i = 0; i + 2 < nodes.size(); i += 3) {
                const auto triangle = on_body<3>(std::span(nodes).subspan(i));
                if (!triangle) continue;
                const auto outwards = outwards_.find(sorted(*triangle));
                triangles.push_back(outwards == outwards_.end() ? *triangle : outwards->second);
            }
        }
    }

    std::string where_;
    double unit_;
    TetMesh mesh_;
    std::vector<QuadraticHexahedron> cells_;  ///< until the groups are read
    std::vector<std::int32_t> cell_regions_;
    std::unordered_map<std::size_t, Vector3> places_;
    std::unordered_map<std::size_t, std::int32_t> numbers_;
    std::map<Triangle, Triangle> outwards_;
};

/// Runs in the child process, which also bounds the lifetime of Gmsh's state.
TetMesh parse(const fs::path& path, double metres_per_unit) {
    gmsh::initialize();
    gmsh::set_number("General.Terminal", 0);
    // Threads of the parent do not exist in the fork.
    gmsh::set_number("General.NumThreads", 1);
    gmsh::start_log();
    try {
        gmsh::open(path);
        if (const std::string error = first_error(); !error.empty())
            fail("{}: Gmsh cannot read it: {}", path.string(), error);
        return Reader(path.string(), metres_per_unit).read();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        fail("{}: Gmsh cannot read it: {}", path.string(), error.what());
    }
}

/// The physical groups and the elements of a mesh as lines of an MSH 2.2 file.
struct Lines {
    std::vector<std::string> names, elements;
    int last_tag = 0;

    int add_group(int dimension, const std::string& name) {
        names.push_back(fmt::format("{} {} \"{}\"", dimension, ++last_tag, name));
        return last_tag;
    }
    /// Adds an element of Gmsh's `type` to physical group `tag`. Its elementary entity has the same
    /// number, from 1.
    template <std::size_t N>
    void add(int type, int tag, int entity, const std::array<std::int32_t, N>& nodes) {
        std::string line = fmt::format("{} {} 2 {} {}", elements.size() + 1, type, tag, entity);
        for (const std::int32_t n : nodes) line += fmt::format(" {}", n + 1);
        elements.push_back(std::move(line));
    }
};

Lines lines_of(const TetMesh& mesh, const std::string& where) {
    Lines lines;
    for (const auto& [name, triangles] : mesh.triangle_sets) {
        const int tag = lines.add_group(2, name);
        for (const Triangle& t : triangles) lines.add(triangle_type, tag, tag, t);
    }
    for (const auto& [name, nodes] : mesh.node_sets) {
        const auto surface = mesh.triangle_sets.find(name);
        if (surface != mesh.triangle_sets.end() && nodes_of(surface->second) == nodes) continue;
        const int tag = lines.add_group(0, name);
        // A point entity has one node, so each node gets its own entity in the group.
        for (const std::int32_t n : nodes) lines.add(15, tag, n + 1, std::array{n});
    }
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const int region = mesh.regions.empty() ? 0 : mesh.regions[e];
        if (region < 0) fail("{}: tet {} is in region {}, expected 0 or more", where, e, region);
        lines.add(tet_type, region, region + 1, mesh.tets[e]);
    }
    return lines;
}

}  // namespace

TetMesh read_gmsh(const fs::path& path, double metres_per_unit) {
    if (ending(path) != ".msh")
        fail("{}: the name ends in '{}', expected a Gmsh mesh: .msh", path.string(), ending(path));
    check_is_whole_mesh(path);
    gmsh::load();
    TetMesh mesh = unpacked_mesh(
        parse_in_child(path, "Gmsh", [&] { return packed(parse(path, metres_per_unit)); }),
        path.string());
    divide_hexahedra(mesh, path.string());
    check_tet_mesh(mesh, path.string());
    return mesh;
}

void write_gmsh(const fs::path& path, const TetMesh& mesh, double metres_per_unit) {
    const Lines lines = lines_of(mesh, path.string());
    std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    if (!lines.names.empty()) {
        text += fmt::format("$PhysicalNames\n{}\n", lines.names.size());
        for (const std::string& line : lines.names) text += line + "\n";
        text += "$EndPhysicalNames\n";
    }
    text += fmt::format("$Nodes\n{}\n", mesh.nodes.size());
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        const Vector3 x = mesh.nodes[n] / metres_per_unit;
        text += fmt::format("{} {} {} {}\n", n + 1, x[0], x[1], x[2]);
    }
    text += fmt::format("$EndNodes\n$Elements\n{}\n", lines.elements.size());
    for (const std::string& line : lines.elements) text += line + "\n";
    write_text_file(path, text + "$EndElements\n");
}

}  // namespace livetet
