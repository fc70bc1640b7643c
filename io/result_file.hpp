#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "io/hdf5.hpp"
#include "io/xdmf.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Storage of displacements: `full` (double) for solves that are compared, `single` (float) for
/// many frames.
enum class Precision { single, full };

/// Records a run as HDF5: mesh and scene once, then one displacement field (metres) a frame.
/// `close` moves the file to its final name and writes an `.xdmf` file beside it for ParaView.
/// Without `close` nothing is left behind. If the program is killed, the file `.NAME.partPID.h5`
/// has everything up to the last `flush`.
///
/// Cuts may add nodes to the mesh during a run (`set_mesh`). Then each frame has the nodes of its
/// own time.
///
/// Order of use: `append` starts a frame; `append_field` and `append_values` belong to the frame
/// last appended.
class ResultWriter {
  public:
    /// Throws Error if the extension is not .h5 or the file cannot be written. The ranks of a
    /// communicator write collectively: each calls the member functions in the same order with the
    /// same values, but for displacements and fields, of which each gives its share of the rows
    /// alone (see row_range), and the mesh, of which each gives its rows (see write_mesh).
    ResultWriter(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::string& scene_text, Precision precision = Precision::full,
                 MPI_Comm comm = MPI_COMM_SELF);

    /// From the next frame on, the mesh is this one: cells and nodes keep their numbers, and nodes
    /// were added. Nodes may lie elsewhere; then earlier frames are of their earlier places.
    /// `originals`: of each node after those of the first mesh, the node that it is a copy of, with
    /// a lower number. Throws Error if they do not belong together, if frames have
    /// fields, or if the disk is full; the mesh before stays.
    void set_mesh(const TetMesh& mesh, std::span<const std::int32_t> originals);
    /// Appends a frame: one displacement for each node of the rank's share. Throws Error if their
    /// number is wrong, a value is not finite, time decreases, or the disk is full. `close` can
    /// still save the frames before it.
    void append(double time_s, std::span<const Vector3> displacement);
    /// Appends a field of the current frame, shown by ParaView under its name: `components` (1, 3
    /// or 9) numbers for each node or tet. Every frame must have the same fields.
    void append_field(const std::string& name, FieldPlace place, int components,
                      std::span<const double> values);
    /// Appends named values of the current frame, the same number in each frame.
    void append_values(const std::string& name, std::span<const double> values);
    /// Appends a row to a named table, independent of the frames; all rows have the same length.
    void append_row(const std::string& name, std::span<const double> row);
    /// Writes a named text about the whole run.
    void write_text(const std::string& name, const std::string& text);
    void flush();
    void close();

    std::size_t frame_count() const { return times_.size(); }

  private:
    std::filesystem::path path_;
    std::unique_ptr<PendingFile> pending_;  // on the first rank
    // Declared after pending_, so that the file is closed before it is removed.
    std::unique_ptr<hdf5::File> file_;
    struct Field {
        std::string name;
        FieldPlace place;
        int components;
    };
    /// A mesh of `set_mesh`.
    struct LaterMesh {
        std::size_t first_frame, nodes;
    };
    std::string xdmf() const;
    /// A growing table and its rows not yet written. Rows are written in batches, because each
    /// write takes a dozen HDF5 calls.
    struct GrowingTable {
        std::string name;
        std::size_t columns;
        std::size_t rows = 0;  ///< including the waiting rows
        std::vector<double> waiting{};
    };
    GrowingTable& growing(const std::string& name, std::size_t columns);
    void add_row(GrowingTable& table, std::span<const double> row);
    void write_waiting(GrowingTable& table);

    std::map<std::string, GrowingTable> tables_;
    std::size_t nodes_ = 0, tets_ = 0, hexahedra_;  ///< of the present mesh
    std::size_t first_nodes_ = 0;                   ///< of the first mesh
    std::vector<LaterMesh> later_;
    bool regions_ = false, quadratic_ = false;
    std::vector<Field> fields_;
    std::vector<double> times_;
    Precision precision_;
    std::vector<float> row_;  ///< buffer for single precision
};

/// Reads a file of ResultWriter. Throws Error, naming file and table, if it is inconsistent.
class ResultReader {
  public:
    explicit ResultReader(const std::filesystem::path& path);

    /// The mesh of all frames: the last one, if it changed.
    const TetMesh& mesh() const { return mesh_; }
    /// The mesh that the run began with.
    TetMesh first_mesh() const;
    const std::string& scene_text() const { return scene_text_; }
    bool has_text(const std::string& name) const { return file_.has("texts/" + name); }
    /// A text of `write_text`. Throws Error if it does not exist.
    std::string text(const std::string& name) const { return file_.read_text("texts/" + name); }
    const std::vector<double>& times_s() const { return times_; }
    std::size_t frame_count() const { return times_.size(); }
    /// The displacement of frame k at each node of `mesh`, in metres. A node that was added later
    /// moves with the one that it is a copy of.
    std::vector<Vector3> displacement(std::size_t k) const;
    /// A field of frame k, as given to `append_field`.
    std::vector<double> field(const std::string& name, std::size_t k, int components) const;
    /// The `count` values of frame k, as given to `append_values`.
    std::vector<double> values(const std::string& name, std::size_t k, std::size_t count) const;
    /// All rows of a table of `append_row`, row-major. Throws Error if it does not exist.
    std::vector<double> rows(const std::string& name, std::size_t columns) const {
        return file_.read<double>("rows/" + name, columns).values;
    }
    bool has_rows(const std::string& name) const { return file_.has("rows/" + name); }
    bool has_values(const std::string& name) const { return file_.has("values/" + name); }
    std::vector<std::string> value_names() const { return file_.names("values"); }
    std::vector<std::string> field_names() const { return file_.names("fields"); }

  private:
    struct LaterMesh {
        double first_frame;
        std::size_t nodes;
    };
    void read_last_mesh();
    std::vector<LaterMesh> read_later(std::size_t meshes) const;
    std::size_t nodes_of_frame(std::size_t k) const;

    hdf5::File file_;
    TetMesh mesh_;
    std::vector<LaterMesh> later_;
    std::size_t first_nodes_ = 0;          ///< of the first mesh
    std::vector<std::int32_t> originals_;  ///< of each node after these, see ResultWriter::set_mesh
    std::string scene_text_;
    std::vector<double> times_;
};

}  // namespace livetet
