#include "io/hierarchy_file.hpp"

#include <fmt/ranges.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/together.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/mesh_of_hexahedra.hpp"

namespace livetet {

namespace {

constexpr const char* hierarchy_format = "livetet mesh hierarchy";
constexpr int hierarchy_version = 1;

/// Flattens rows of fixed size.
template <class T, class Row>
std::span<const T> flat(const std::vector<Row>& rows) {
    static_assert(sizeof(Row) % sizeof(T) == 0);
    return {reinterpret_cast<const T*>(rows.data()), rows.size() * (sizeof(Row) / sizeof(T))};
}

/// Reads tables, of which each of several ranks takes its rows.
class RowReader {
  public:
    explicit RowReader(const hdf5::File& file, std::size_t rank = 0, std::size_t ranks = 1)
        : file_(file), rank_(rank), ranks_(ranks) {}

    RowRange range(std::size_t rows) const { return row_range(rows, rank_, ranks_); }
    template <class T>
    std::vector<T> numbers(const std::string& name, std::size_t columns = 1) const {
        if (ranks_ == 1) return file_.read<T>(name, columns).values;
        return file_.read_range<T>(name, range(file_.rows(name, columns)), columns);
    }
    template <class T, std::size_t N>
    std::vector<std::array<T, N>> rows(const std::string& name) const {
        const std::vector<T> values = numbers<T>(name, N);
        std::vector<std::array<T, N>> rows(values.size() / N);
        for (std::size_t r = 0; r < rows.size(); ++r)
            std::copy_n(values.begin() + r * N, N, rows[r].begin());
        return rows;
    }
    const hdf5::File& file() const { return file_; }

  private:
    const hdf5::File& file_;
    std::size_t rank_, ranks_;
};

void check_indices(std::span<const std::int32_t> indices, std::size_t count,
                   const std::string& where) {
    for (const std::int32_t n : indices)
        if (n < 0 || static_cast<std::size_t>(n) >= count)
            fail("{}: names node {}, expected 0 to {}", where, n,
                 static_cast<std::int64_t>(count) - 1);
}

/// Escapes a set's name for HDF5, where '/' separates groups and "." is the group itself.
std::string escape(const std::string& name) {
    std::string text;
    for (const char c : name)
        text += c == '/' || c == '%' || c == '.' ? fmt::format("%{:02x}", c) : std::string(1, c);
    return text.empty() ? "%" : text;
}

std::string unescape(const std::string& text) {
    std::string name;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::string_view code = std::string_view(text).substr(i, 3);
        const char c = code == "%2f" ? '/' : code == "%25" ? '%' : code == "%2e" ? '.' : '\0';
        if (c) i += 2;
        if (c || text[i] != '%') name += c ? c : text[i];
    }
    return name;
}

/// `points`: nodes of the finer level; `nodes`: of the coarser one.
BarycentricMap read_transfer(const RowReader& reader, const std::string& group, std::size_t points,
                             std::size_t nodes) {
    const hdf5::File& file = reader.file();
    const std::string where = fmt::format("{}: {}", file.shown(), group);
    const std::size_t counts[3] = {file.rows(group + "/nodes", 4), file.rows(group + "/weights", 4),
                                   file.rows(group + "/distance", 1)};
    if (counts[0] != points || counts[1] != points || counts[2] != points)
        fail(
            "{}: has {} nodes, {} weights, {} distances, expected one for each of {} nodes of the "
            "finer level",
            where, counts[0], counts[1], counts[2], points);
    BarycentricMap map{reader.rows<std::int32_t, 4>(group + "/nodes"),
                       reader.rows<double, 4>(group + "/weights"),
                       reader.numbers<double>(group + "/distance")};
    check_indices(flat<std::int32_t>(map.nodes), nodes, where + "/nodes");
    const std::size_t first = reader.range(points).first;
    for (std::size_t i = 0; i < map.size(); ++i) {
        const auto& w = map.weights[i];
        // Written so that NaN fails the test.
        const bool bounded = std::all_of(
            w.begin(), w.end(), [](double v) { return v >= min_extrapolated_weight - 1e-6; });
        if (!bounded || !(std::abs(w[0] + w[1] + w[2] + w[3] - 1) < 1e-6))
            fail("{}/weights: row {} is {}, {}, {}, {}, expected weights from {} on that sum to 1",
                 where, first + i, w[0], w[1], w[2], w[3], min_extrapolated_weight);
        if (!(map.distance[i] >= 0))
            fail("{}/distance: row {} is {}, expected metres", where, first + i, map.distance[i]);
    }
    return map;
}

void write_grid(hdf5::File& file, const ImageGrid& image) {
    file.write<std::int32_t>("image/size", image.size, 3);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = image.ras_from_voxel;
    file.write<double>("image/ras_from_voxel", {rows.data(), 16}, 4);
    const Eigen::Vector3d spacing = image.spacing();  // redundant; for readers of the file
    file.write<double>("image/spacing", {spacing.data(), 3}, 3);
}

ImageGrid read_grid(const hdf5::File& file) {
    const auto size = file.read<std::int32_t>("image/size", 3).values;
    const auto rows = file.read<double>("image/ras_from_voxel", 4).values;
    if (size.size() != 3 || *std::min_element(size.begin(), size.end()) < 1)
        fail("{}: image/size is {}, expected three numbers of voxels", file.shown(),
             fmt::join(size, " x "));
    if (rows.size() != 16)
        fail("{}: image/ras_from_voxel has {} numbers, expected 16", file.shown(), rows.size());
    ImageGrid image{{size[0], size[1], size[2]},
                    Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(rows.data())};
    const double volume = image.ras_from_voxel.topLeftCorner<3, 3>().determinant();
    if (!image.ras_from_voxel.allFinite() || !(std::abs(volume) > 0) ||
        image.ras_from_voxel.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
        fail(
            "{}: image/ras_from_voxel is not an invertible affine, expected positions of voxels in "
            "metres",
            file.shown());
    return image;
}

/// Between the order of our corners and that of VTK and XDMF, round each layer; the same both ways.
constexpr int round_order[8] = {0, 1, 3, 2, 4, 5, 7, 6};

Hexahedron reordered(const Hexahedron& from) {
    Hexahedron to{};
    for (int c = 0; c < 8; ++c) to[c] = from[round_order[c]];
    return to;
}

void write_hexahedra(hdf5::File& file, const std::string& group, const TetMesh& mesh) {
    std::vector<Hexahedron> rows;
    rows.reserve(mesh.hexahedra.size());
    for (const Hexahedron& h : mesh.hexahedra) rows.push_back(reordered(h));
    file.write<std::int32_t>(group + "/hexahedra", flat<std::int32_t>(rows), 8);
    file.write<double>(group + "/shares", mesh.shares, 1);
    if (mesh.regions.empty()) return;
    std::vector<std::int32_t> regions;
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        regions.push_back(mesh.regions[tets_per_hexahedron * e]);
    file.write<std::int32_t>(group + "/regions", regions, 1);
}

void read_hexahedra(const hdf5::File& file, const std::string& group, TetMesh& mesh) {
    const std::string where = fmt::format("{}: {}", file.shown(), group);
    for (const auto& row : RowReader(file).rows<std::int32_t, 8>(group + "/hexahedra"))
        mesh.hexahedra.push_back(reordered(row));
    mesh.shares = file.read<double>(group + "/shares", 1).values;
    divide_hexahedra(mesh, where);
    if (!file.has(group + "/regions")) return;
    const auto regions = file.read<std::int32_t>(group + "/regions", 1).values;
    if (regions.size() != mesh.hexahedra.size())
        fail("{}: {} region labels for {} hexahedra, expected one each", where, regions.size(),
             mesh.hexahedra.size());
    for (const std::int32_t region : regions)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, region);
}

}  // namespace

void write_mesh(hdf5::File& file, const std::string& group, const TetMesh& mesh) {
    file.write_parts<double>(group + "/nodes", flat<double>(mesh.nodes), 3);
    if (mesh.hexahedra.empty())
        file.write_parts<std::int32_t>(group + "/tets", flat<std::int32_t>(mesh.tets), 4);
    else
        write_hexahedra(file, group, mesh);
    if (!mesh.quadratic_hexahedra.empty()) {  // on one rank
        file.write<std::int32_t>(group + "/quadratic_hexahedra",
                                 flat<std::int32_t>(mesh.quadratic_hexahedra), 27);
        if (!mesh.shares.empty()) file.write<double>(group + "/shares", mesh.shares, 1);
    }
    if (file.sum(mesh.edge_nodes.size()) > 0) {
        // One table with all ten nodes, as XDMF's Tetrahedron_10 requires.
        std::vector<std::int32_t> ten;
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
            ten.insert(ten.end(), mesh.tets[e].begin(), mesh.tets[e].end());
            ten.insert(ten.end(), mesh.edge_nodes[e].begin(), mesh.edge_nodes[e].end());
        }
        file.write_parts<std::int32_t>(group + "/ten_node_tets", ten, 10);
    }
    if (mesh.hexahedra.empty() && file.sum(mesh.regions.size()) > 0)
        file.write_parts<std::int32_t>(group + "/regions", mesh.regions, 1);
    for (const auto& [name, nodes] : mesh.node_sets)
        file.write_parts<std::int32_t>(group + "/node_sets/" + escape(name), nodes, 1);
    for (const auto& [name, triangles] : mesh.triangle_sets)
        file.write_parts<std::int32_t>(group + "/triangle_sets/" + escape(name),
                                       flat<std::int32_t>(triangles), 3);
}

std::size_t bytes_written(const TetMesh& mesh) {
    constexpr std::size_t index = sizeof(std::int32_t);
    std::size_t bytes =
        mesh.nodes.size() * sizeof(Vector3) +
        (4 * mesh.tets.size() + 10 * mesh.edge_nodes.size() + mesh.regions.size()) * index +
        mesh.hexahedra.size() * (sizeof(Hexahedron) + sizeof(double)) +
        mesh.quadratic_hexahedra.size() * (sizeof(QuadraticHexahedron) + sizeof(double));
    for (const auto& [name, nodes] : mesh.node_sets) bytes += nodes.size() * index;
    for (const auto& [name, triangles] : mesh.triangle_sets) bytes += 3 * triangles.size() * index;
    return bytes;
}

namespace {

MeshSize size_of(const hdf5::File& file, const std::string& group) {
    return {file.rows(group + "/nodes", 3), file.rows(group + "/tets", 4)};
}

/// Nodes, tets and regions of a mesh without hexahedra.
TetMesh read_tets(const RowReader& reader, const std::string& group) {
    TetMesh mesh;
    const hdf5::File& file = reader.file();
    for (const auto& x : reader.rows<double, 3>(group + "/nodes"))
        mesh.nodes.emplace_back(x[0], x[1], x[2]);
    mesh.tets = reader.rows<std::int32_t, 4>(group + "/tets");
    if (file.has(group + "/ten_node_tets"))
        for (const auto& ten : reader.rows<std::int32_t, 10>(group + "/ten_node_tets"))
            mesh.edge_nodes.push_back({ten[4], ten[5], ten[6], ten[7], ten[8], ten[9]});
    if (file.has(group + "/regions"))
        mesh.regions = reader.numbers<std::int32_t>(group + "/regions");
    return mesh;
}

/// The hexahedra that a mesh's tets are those of.
void read_quadratic(const hdf5::File& file, const std::string& group, TetMesh& mesh) {
    const std::string where = fmt::format("{}: {}", file.shown(), group);
    mesh.quadratic_hexahedra =
        RowReader(file).rows<std::int32_t, 27>(group + "/quadratic_hexahedra");
    if (file.has(group + "/shares")) mesh.shares = file.read<double>(group + "/shares", 1).values;
    const std::vector<Tet> stored = std::move(mesh.tets);
    divide_hexahedra(mesh, where);
    if (mesh.tets != stored || !mesh.edge_nodes.empty())
        fail("{}: its tets are not those of its quadratic_hexahedra, expected 48 of each", where);
    for (std::size_t t = 0; t < mesh.regions.size(); ++t)
        if (mesh.regions[t] != mesh.regions[t - t % tets_per_quadratic_hexahedron])
            fail("{}: hexahedron {} is in two regions, expected one", where,
                 t / tets_per_quadratic_hexahedron);
}

/// `nodes`: of the whole mesh.
void read_sets(const RowReader& reader, const std::string& group, std::size_t nodes,
               TetMesh& mesh) {
    const hdf5::File& file = reader.file();
    for (const std::string& name : file.names(group + "/node_sets")) {
        const std::string table = group + "/node_sets/" + name,
                          where = fmt::format("{}: {}", file.shown(), table);
        auto set = reader.numbers<std::int32_t>(table);
        check_indices(set, nodes, where);
        if (std::adjacent_find(set.begin(), set.end(), std::greater_equal{}) != set.end())
            fail("{}: its nodes are not in order, expected them sorted, each once", where);
        mesh.node_sets[unescape(name)] = std::move(set);
    }
    for (const std::string& name : file.names(group + "/triangle_sets")) {
        const std::string table = group + "/triangle_sets/" + name;
        auto triangles = reader.rows<std::int32_t, 3>(table);
        check_indices(flat<std::int32_t>(triangles), nodes,
                      fmt::format("{}: {}", file.shown(), table));
        mesh.triangle_sets[unescape(name)] = std::move(triangles);
    }
}

/// Throws Error if a mesh of tets has none, or not one region or row of edge nodes for each.
void check_counts(const hdf5::File& file, const std::string& group, const MeshSize& size) {
    const std::string where = fmt::format("{}: {}", file.shown(), group);
    if (size.tets == 0) fail("{}: the mesh has no tetrahedra, expected at least one", where);
    const auto check = [&](const char* table, std::size_t columns, const char* what) {
        if (!file.has(group + table)) return;
        if (const std::size_t rows = file.rows(group + table, columns); rows != size.tets)
            fail("{}: {} {} for {} tets, expected one each", where, rows, what, size.tets);
    };
    check("/regions", 1, "region labels");
    check("/ten_node_tets", 10, "sets of edge nodes");
}

std::size_t count_levels(const hdf5::File& file) {
    hdf5::check_format(file, hierarchy_format, hierarchy_version);
    const std::size_t levels = file.names("levels").size();
    if (levels == 0) fail("{}: holds no levels, expected at least one", file.shown());
    return levels;
}

/// One rank's rows, without messages.
HierarchyRows read_rows(const std::filesystem::path& path, std::size_t rank, std::size_t ranks,
                        hdf5::Validation validation) {
    const hdf5::File file = hdf5::File::open(path, validation);
    const RowReader reader(file, rank, ranks);
    const std::size_t levels = count_levels(file);
    HierarchyRows mine;
    mine.rows.provenance = file.read_text("provenance");
    for (std::size_t l = 0; l < levels; ++l) {
        const std::string group = fmt::format("levels/{}", l),
                          where = fmt::format("{}: {}", file.shown(), group);
        if (file.has(group + "/hexahedra") || file.has(group + "/quadratic_hexahedra"))
            fail("{} ranks: found a mesh of hexahedra in {}, expected tetrahedra", ranks, where);
        const MeshSize size = mine.sizes.emplace_back(size_of(file, group));
        check_counts(file, group, size);
        TetMesh& mesh = mine.rows.levels.emplace_back(read_tets(reader, group));
        check_rows(mesh, size, {reader.range(size.nodes).first, reader.range(size.tets).first},
                   where);
        read_sets(reader, group, size.nodes, mesh);
    }
    for (std::size_t l = 0; l + 1 < levels; ++l)
        mine.rows.transfers.push_back(read_transfer(reader, fmt::format("transfers/{}", l),
                                                    mine.sizes[l].nodes, mine.sizes[l + 1].nodes));
    return mine;
}

}  // namespace

TetMesh read_mesh(const hdf5::File& file, const std::string& group) {
    const RowReader reader(file);
    TetMesh mesh;
    if (file.has(group + "/hexahedra")) {
        for (const auto& x : reader.rows<double, 3>(group + "/nodes"))
            mesh.nodes.emplace_back(x[0], x[1], x[2]);
        read_hexahedra(file, group, mesh);
    } else {
        mesh = read_tets(reader, group);
        if (file.has(group + "/quadratic_hexahedra")) read_quadratic(file, group, mesh);
    }
    check_tet_mesh(mesh, fmt::format("{}: {}", file.shown(), group));
    read_sets(reader, group, mesh.nodes.size(), mesh);
    return mesh;
}

HierarchyRows read_hierarchy_rows(MPI_Comm comm, const std::filesystem::path& path) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    HierarchyRows mine;
    const auto read = [&](hdf5::Validation validation) {
        mine = read_rows(path, static_cast<std::size_t>(rank), static_cast<std::size_t>(ranks),
                         validation);
    };
    together(comm, [&] {  // one rank looks for damage
        if (rank == 0) read(hdf5::Validation::now);
    });
    together(comm, [&] {
        if (rank != 0) read(hdf5::Validation::done);
    });
    return mine;
}

void write_hierarchy(const std::filesystem::path& path, const MeshHierarchy& hierarchy,
                     const std::optional<ImageGrid>& image) {
    std::size_t bytes = hierarchy.provenance.size();
    for (const TetMesh& level : hierarchy.levels) bytes += bytes_written(level);
    for (const BarycentricMap& map : hierarchy.transfers)
        bytes += map.size() * (4 * sizeof(std::int32_t) + 5 * sizeof(double));
    hdf5::write_whole(path, hierarchy_format, hierarchy_version, bytes, [&](hdf5::File& file) {
        file.write_text("provenance", hierarchy.provenance);
        file.write_text("world", "RAS, metres");
        if (image) write_grid(file, *image);
        for (std::size_t l = 0; l < hierarchy.levels.size(); ++l)
            write_mesh(file, fmt::format("levels/{}", l), hierarchy.levels[l]);
        for (std::size_t l = 0; l < hierarchy.transfers.size(); ++l) {
            const std::string group = fmt::format("transfers/{}", l);
            const BarycentricMap& map = hierarchy.transfers[l];
            file.write<std::int32_t>(group + "/nodes", flat<std::int32_t>(map.nodes), 4);
            file.write<double>(group + "/weights", flat<double>(map.weights), 4);
            file.write<double>(group + "/distance", map.distance, 1);
        }
    });
}

std::optional<ImageGrid> read_image_grid(const std::filesystem::path& path) {
    const hdf5::File file = hdf5::File::open(path);
    hdf5::check_format(file, hierarchy_format, hierarchy_version);
    if (!file.has("image/size")) return {};
    return read_grid(file);
}

MeshHierarchy read_hierarchy(const std::filesystem::path& path) {
    const hdf5::File file = hdf5::File::open(path);
    const std::size_t levels = count_levels(file);
    MeshHierarchy hierarchy;
    hierarchy.provenance = file.read_text("provenance");
    for (std::size_t l = 0; l < levels; ++l)
        hierarchy.levels.push_back(read_mesh(file, fmt::format("levels/{}", l)));
    for (std::size_t l = 0; l + 1 < levels; ++l)
        hierarchy.transfers.push_back(read_transfer(RowReader(file), fmt::format("transfers/{}", l),
                                                    hierarchy.levels[l].nodes.size(),
                                                    hierarchy.levels[l + 1].nodes.size()));
    return hierarchy;
}

}  // namespace livetet
