#include "mesh/packed_mesh.hpp"

#include "base/packing.hpp"

namespace livetet {

namespace {

static_assert(sizeof(Vector3) == 3 * sizeof(double));

template <class T>
void add_sets(Packer& packer, const std::map<std::string, std::vector<T>>& sets) {
    packer.add_count(sets.size());
    for (const auto& [name, members] : sets) {
        packer.add(name);
        packer.add(members);
    }
}

template <class T>
void take_sets(Unpacker& unpacker, std::map<std::string, std::vector<T>>& sets) {
    for (std::uint64_t left = unpacker.take_count(); left > 0; --left) {
        const std::string name = unpacker.take_text();
        sets[name] = unpacker.take<T>();
    }
}

void check_node(std::int32_t node, const TetMesh& mesh, const std::string& set,
                const std::string& who) {
    if (node < 0 || node >= std::ssize(mesh.nodes))
        fail("{}: '{}' names node {}, expected 0 to {}", who, set, node,
             std::ssize(mesh.nodes) - 1);
}

}  // namespace

std::vector<char> packed(const TetMesh& mesh) {
    Packer packer;
    packer.add(mesh.nodes);
    packer.add(mesh.tets);
    packer.add(mesh.regions);
    packer.add(mesh.hexahedra);
    packer.add(mesh.shares);
    packer.add(mesh.quadratic_hexahedra);
    add_sets(packer, mesh.node_sets);
    add_sets(packer, mesh.triangle_sets);
    return packer.take_bytes();
}

TetMesh unpacked_mesh(std::span<const char> bytes, const std::string& who) {
    Unpacker unpacker(bytes, who);
    TetMesh mesh;
    mesh.nodes = unpacker.take<Vector3>();
    mesh.tets = unpacker.take<Tet>();
    mesh.regions = unpacker.take<std::int32_t>();
    mesh.hexahedra = unpacker.take<Hexahedron>();
    mesh.shares = unpacker.take<double>();
    mesh.quadratic_hexahedra = unpacker.take<QuadraticHexahedron>();
    take_sets(unpacker, mesh.node_sets);
    take_sets(unpacker, mesh.triangle_sets);
    unpacker.finish();
    for (const auto& [name, nodes] : mesh.node_sets)
        for (const std::int32_t n : nodes) check_node(n, mesh, name, who);
    for (const auto& [name, triangles] : mesh.triangle_sets)
        for (const Triangle& t : triangles)
            for (const std::int32_t n : t) check_node(n, mesh, name, who);
    return mesh;
}

}  // namespace livetet
