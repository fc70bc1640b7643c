#include "io/result_file.hpp"

#include <array>
#include <cmath>
#include <tuple>

#include "base/error.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

constexpr const char* result_format = "livetet result";
constexpr int result_version = 1;

/// Space for a frame's values and the final texts, beside its displacement; tables grow by 64 kB
/// each.
constexpr std::size_t room_beside = 4 << 20;
constexpr std::size_t max_rows_waiting = 64;  // rows

constexpr const char* first_mesh_group = "mesh";
/// Of each mesh of `set_mesh`: number of the first frame that has it, and of its nodes.
constexpr const char* later_meshes = "later_meshes";
std::string later_group(std::size_t number) { return fmt::format("meshes/{:06}", number); }

/// Throws Error unless a mesh continues one of `first` nodes with copies of nodes.
void check_originals(const TetMesh& mesh, std::size_t first,
                     std::span<const std::int32_t> originals, const std::string& where) {
    if (mesh.nodes.size() != first + originals.size())
        fail("{}: has {} nodes, expected the {} of the first mesh and {} copies", where,
             mesh.nodes.size(), first, originals.size());
    for (std::size_t k = 0; k < originals.size(); ++k)
        if (originals[k] < 0 || originals[k] >= static_cast<std::int64_t>(first + k))
            fail("{}: node {} is a copy of node {}, expected one with a lower number", where,
                 first + k, originals[k]);
}

/// One table for each frame: every XDMF reader supports that, but not slabs of a larger table.
std::string frame_table(std::size_t k) { return fmt::format("displacement/{:06}", k); }
std::string field_table(const std::string& name, std::size_t k) {
    return fmt::format("fields/{}/{:06}", name, k);
}

}  // namespace

ResultWriter::ResultWriter(const fs::path& path, const TetMesh& mesh, const std::string& scene_text,
                           Precision precision, MPI_Comm comm)
    : path_(path), hexahedra_(mesh.hexahedra.size()), precision_(precision) {
    if (ending(path) != ".h5")
        fail("{}: the name ends in '{}', expected .h5 for a result", path.string(), ending(path));
    int ranks = 1;
    if (comm != MPI_COMM_SELF) MPI_Comm_size(comm, &ranks);
    if (ranks == 1) check_tet_mesh(mesh, path.string());
    std::string temporary;
    std::tie(pending_, temporary) = hdf5::begin_pending(path, comm);
    if (pending_) warn_of_left_parts(path);
    file_ = std::make_unique<hdf5::File>(hdf5::File::create(temporary, path.string(), comm));
    nodes_ = first_nodes_ = file_->sum(mesh.nodes.size());
    tets_ = file_->sum(mesh.tets.size());
    regions_ = file_->sum(mesh.regions.size()) > 0;
    quadratic_ = file_->sum(mesh.edge_nodes.size()) > 0;
    if (!file_->reserve(file_->sum(bytes_written(mesh)) + scene_text.size() + room_beside))
        fail("{}: no room on the disk for the mesh", path.string());
    hdf5::write_format(*file_, result_format, result_version);
    file_->write_text("scene", scene_text);
    write_mesh(*file_, first_mesh_group, mesh);
    growing("times", 1);
}

void ResultWriter::set_mesh(const TetMesh& mesh, std::span<const std::int32_t> originals) {
    const std::string where =
        fmt::format("{}: mesh from frame {} on", path_.string(), times_.size());
    if (!file_) fail("{}: comes after the file was closed", where);
    if (!fields_.empty()) fail("{}: comes after fields, expected displacements only", where);
    if (mesh.tets.size() != tets_ || mesh.nodes.size() < nodes_)
        fail("{}: has {} nodes and {} tets, expected at least {} and {}", where, mesh.nodes.size(),
             mesh.tets.size(), nodes_, tets_);
    check_originals(mesh, first_nodes_, originals, where);
    check_tet_mesh(mesh, where);
    if (!file_->reserve(bytes_written(mesh) + originals.size_bytes() + room_beside))
        fail("{}: no room on the disk", where);
    const std::string group = later_group(later_.size());
    write_mesh(*file_, group, mesh);
    file_->write<std::int32_t>(group + "/originals", originals, 1);
    later_.push_back({times_.size(), mesh.nodes.size()});
    const std::array<double, 2> row{static_cast<double>(times_.size()),
                                    static_cast<double>(mesh.nodes.size())};
    add_row(growing(later_meshes, row.size()), row);
    nodes_ = mesh.nodes.size();
}

ResultWriter::GrowingTable& ResultWriter::growing(const std::string& name, std::size_t columns) {
    auto place = tables_.find(name);
    if (place == tables_.end()) {
        file_->create_growing<double>(name, columns);
        place = tables_.try_emplace(name, GrowingTable{name, columns}).first;
    }
    if (place->second.columns != columns)
        fail("{}: a row of table {} has {} numbers, expected {}", path_.string(), name, columns,
             place->second.columns);
    return place->second;
}

void ResultWriter::add_row(GrowingTable& table, std::span<const double> row) {
    table.waiting.insert(table.waiting.end(), row.begin(), row.end());
    if (++table.rows % max_rows_waiting == 0) write_waiting(table);
}

void ResultWriter::write_waiting(GrowingTable& table) {
    if (table.waiting.empty()) return;
    file_->write_rows<double>(table.name, table.rows - table.waiting.size() / table.columns,
                              table.waiting, table.columns);
    table.waiting.clear();
}

void ResultWriter::flush() {
    for (auto& [name, table] : tables_) write_waiting(table);
    file_->flush();
}

void ResultWriter::append(double time_s, std::span<const Vector3> displacement) {
    const std::size_t k = times_.size();
    if (!file_) fail("{}: frame {} comes after the file was closed", path_.string(), k);
    const RowRange mine = file_->share_of(nodes_);
    if (!std::isfinite(time_s) || (k > 0 && time_s < times_.back()))
        fail("{}: frame {} is at {} s after {} s, expected time not to go backwards",
             path_.string(), k, time_s, k > 0 ? times_.back() : 0);
    file_->together([&] {
        if (displacement.size() != mine.size())
            fail("{}: frame {} has {} displacements, expected {}", path_.string(), k,
                 displacement.size(), mine.size());
        for (std::size_t n = 0; n < displacement.size(); ++n)
            if (!displacement[n].allFinite())
                fail("{}: frame {}: the displacement of node {} is not finite", path_.string(), k,
                     mine.first + n);
    });
    const std::span<const double> numbers(
        displacement.empty() ? nullptr : displacement.front().data(), 3 * displacement.size());
    if (!file_->reserve(3 * nodes_ * sizeof(double) + room_beside))
        fail("{}: no room on the disk for frame {}", path_.string(), k);
    if (precision_ == Precision::full) {
        file_->write_share<double>(frame_table(k), nodes_, numbers, 3);
    } else {
        row_.assign(numbers.begin(), numbers.end());
        file_->write_share<float>(frame_table(k), nodes_, row_, 3);
    }
    times_.push_back(time_s);
    add_row(growing("times", 1), {&time_s, 1});
}

void ResultWriter::append_field(const std::string& name, FieldPlace place, int components,
                                std::span<const double> values) {
    if (!file_ || times_.empty()) fail("{}: field {} comes without a frame", path_.string(), name);
    const std::size_t rows = place == FieldPlace::node ? nodes_ : tets_;
    const std::size_t here = file_->share_of(rows).size();
    if (values.size() != here * components)
        fail("{}: field {} has {} numbers, expected {} for each of {}", path_.string(), name,
             values.size(), components, here);
    if (!file_->reserve(rows * components * sizeof(double) + room_beside))
        fail("{}: no room on the disk for field {}", path_.string(), name);
    if (times_.size() == 1) fields_.push_back({name, place, components});
    std::vector<double> kept;  // of a grid the hexahedra's, whose six tets are alike
    const bool is_alike = hexahedra_ > 0 && place == FieldPlace::tet;
    const std::size_t alike = is_alike ? tets_per_hexahedron : 1;
    for (std::size_t i = 0; is_alike && i < values.size(); i += alike * components) {
        const std::span<const double> row = values.subspan(i, components);
        kept.insert(kept.end(), row.begin(), row.end());
    }
    file_->write_share<double>(field_table(name, times_.size() - 1), rows / alike,
                               is_alike ? std::span<const double>(kept) : values,
                               static_cast<std::size_t>(components));
}

void ResultWriter::append_values(const std::string& name, std::span<const double> values) {
    if (!file_) fail("{}: values {} come after the file was closed", path_.string(), name);
    if (name.empty() || name.find_first_of("/.") != std::string::npos || values.empty())
        fail("{}: '{}' with {} values, expected a name without '/' and '.' and a value",
             path_.string(), name, values.size());
    GrowingTable& table = growing("values/" + name, values.size());
    if (table.rows + 1 != times_.size())
        fail("{}: values {} for frame {} after {} frames, expected them once with each frame",
             path_.string(), name, table.rows, times_.size());
    add_row(table, values);
}

void ResultWriter::append_row(const std::string& name, std::span<const double> row) {
    if (!file_) fail("{}: a row of {} comes after the file was closed", path_.string(), name);
    add_row(growing("rows/" + name, row.size()), row);
}

void ResultWriter::write_text(const std::string& name, const std::string& text) {
    if (!file_->reserve(text.size()))
        fail("{}: no room on the disk for the text {}", path_.string(),
             name);  // the companion files exist since the last frame
    file_->write_text("texts/" + name, text);
}

void ResultWriter::close() {
    if (!file_) return;
    flush();
    file_->give_back();
    file_.reset();
    if (!pending_) return;
    pending_->commit();
    fs::path xdmf = path_;
    write_text_file(xdmf.replace_extension(".xdmf"), this->xdmf());
}

std::string ResultWriter::xdmf() const {
    std::vector<XdmfFrame> frames;
    std::size_t later = 0;  // number of the next mesh
    for (std::size_t k = 0; k < times_.size(); ++k) {
        while (later < later_.size() && later_[later].first_frame <= k) ++later;
        XdmfFrame& frame =
            frames.emplace_back(XdmfFrame{times_[k],
                                          later > 0 ? later_group(later - 1) : first_mesh_group,
                                          later > 0 ? later_[later - 1].nodes : first_nodes_,
                                          hexahedra_ > 0 ? hexahedra_ : tets_,
                                          quadratic_,
                                          regions_,
                                          {},
                                          hexahedra_ > 0});
        frame.fields.push_back({"displacement", frame_table(k), FieldPlace::node, 3,
                                precision_ == Precision::full ? 8 : 4});
        for (const Field& f : fields_)
            frame.fields.push_back({f.name, field_table(f.name, k), f.place, f.components});
    }
    return xdmf_text(path_.filename().string(), frames);
}

ResultReader::ResultReader(const fs::path& path) : file_(hdf5::File::open(path)) {
    hdf5::check_format(file_, result_format, result_version);
    mesh_ = read_mesh(file_, first_mesh_group);
    first_nodes_ = mesh_.nodes.size();
    if (file_.has(later_meshes)) read_last_mesh();
    scene_text_ = file_.read_text("scene");
    for (std::size_t k = 0; k < file_.rows("times", 1); ++k)
        times_.push_back(file_.read_row<double>("times", k, 1)[0]);
    for (std::size_t k = 0; k < times_.size(); ++k)
        if (!std::isfinite(times_[k]) || (k > 0 && times_[k] < times_[k - 1]))
            fail("{}: table times: row {} is {} s, expected time not to go backwards",
                 path.string(), k, times_[k]);
}

void ResultReader::read_last_mesh() {
    const std::size_t meshes = file_.rows(later_meshes, 2);
    if (meshes == 0) return;  // the program was killed before it was written
    const std::string group = later_group(meshes - 1);
    TetMesh last = read_mesh(file_, group);
    originals_ = file_.read<std::int32_t>(group + "/originals", 1).values;
    const std::string where = fmt::format("{}: {}", file_.shown(), group);
    check_originals(last, first_nodes_, originals_, where);
    if (last.tets.size() != mesh_.tets.size())
        fail("{}: has {} tets, expected the {} of the first mesh", where, last.tets.size(),
             mesh_.tets.size());
    mesh_ = std::move(last);
    later_ = read_later(meshes);
}

/// From which frame on each later mesh was used, and how many nodes it has.
std::vector<ResultReader::LaterMesh> ResultReader::read_later(std::size_t meshes) const {
    const std::vector<double> rows = file_.read<double>(later_meshes, 2).values;
    std::vector<LaterMesh> later;
    double frame = 0, nodes = static_cast<double>(first_nodes_);
    for (std::size_t i = 0; i < meshes; ++i) {
        const std::size_t stored = file_.rows(later_group(i) + "/nodes", 3);
        if (!(rows[2 * i] >= frame && rows[2 * i + 1] >= nodes) ||
            rows[2 * i + 1] != static_cast<double>(stored))
            fail(
                "{}: table {}: row {} is ({}, {}), expected a frame from {} on and the {} nodes of "
                "{}",
                file_.shown(), later_meshes, i, rows[2 * i], rows[2 * i + 1], frame, stored,
                later_group(i));
        frame = rows[2 * i], nodes = rows[2 * i + 1];
        later.push_back({frame, stored});
    }
    return later;
}

std::size_t ResultReader::nodes_of_frame(std::size_t k) const {
    std::size_t nodes = first_nodes_;
    for (const LaterMesh& mesh : later_)
        if (mesh.first_frame <= static_cast<double>(k)) nodes = mesh.nodes;
    return nodes;
}

TetMesh ResultReader::first_mesh() const {
    return originals_.empty() ? mesh_ : read_mesh(file_, first_mesh_group);
}

std::vector<Vector3> ResultReader::displacement(std::size_t k) const {
    if (k >= times_.size())
        fail("{}: holds {} frames, expected one of number {}", file_.shown(), times_.size(), k);
    const auto table = file_.read<double>(frame_table(k), 3);
    if (table.rows != nodes_of_frame(k))
        fail("{}: table {} has {} rows, expected {}", file_.shown(), frame_table(k), table.rows,
             nodes_of_frame(k));
    std::vector<Vector3> displacement;
    displacement.reserve(mesh_.nodes.size());
    for (std::size_t n = 0; n < table.rows; ++n) {
        displacement.emplace_back(table.values[3 * n], table.values[3 * n + 1],
                                  table.values[3 * n + 2]);
        if (!displacement.back().allFinite())
            fail("{}: table {}: row {} is not finite", file_.shown(), frame_table(k), n);
    }
    while (displacement.size() < mesh_.nodes.size())
        displacement.push_back(displacement[originals_[displacement.size() - first_nodes_]]);
    return displacement;
}

std::vector<double> ResultReader::values(const std::string& name, std::size_t k,
                                         std::size_t count) const {
    return file_.read_row<double>("values/" + name, k, count);
}

std::vector<double> ResultReader::field(const std::string& name, std::size_t k,
                                        int components) const {
    std::vector<double> values = file_.read<double>(field_table(name, k), components).values;
    const auto columns = static_cast<std::size_t>(components);
    if (mesh_.hexahedra.empty() || values.size() != columns * mesh_.hexahedra.size()) return values;
    std::vector<double> of_tets;
    of_tets.reserve(tets_per_hexahedron * values.size());
    for (std::size_t i = 0; i < values.size(); i += columns)
        for (std::size_t k6 = 0; k6 < tets_per_hexahedron; ++k6)
            of_tets.insert(of_tets.end(), values.begin() + static_cast<std::ptrdiff_t>(i),
                           values.begin() + static_cast<std::ptrdiff_t>(i + columns));
    return of_tets;
}

}  // namespace livetet
