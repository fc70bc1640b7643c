#pragma once

#include <cstddef>
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

/// How displacements are kept: `full` (8 bytes a number) for solves that are compared, `single` (4)
/// for many frames.
enum class Precision { single, full };

/// Records a run: mesh and scene once, then a displacement (metres) for each frame, in HDF5;
/// `close` moves the file to its place and writes an `.xdmf` of the same name beside it, which
/// ParaView opens. Without `close` nothing is left behind, but where the program is killed: then
/// all to the last `flush`, as `.NAME.partPID.h5`.
class ResultWriter {
  public:
    /// Throws Error where the name does not end in .h5 or the file cannot be written. The ranks of
    /// a communicator write together: each calls all of what follows alike, with the same values.
    ResultWriter(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::string& scene_text, Precision precision = Precision::full,
                 MPI_Comm comm = MPI_COMM_SELF);

    /// One frame more: a displacement for each node. Throws Error where they are not as many as the
    /// nodes or not finite, time goes backwards, or the disk has no room for it; the frames before
    /// it can still be kept by `close`.
    void append(double time_s, std::span<const Vector3> displacement);
    /// A field of the frame last appended, shown by ParaView under its name: `components` (1, 3 or
    /// 9) numbers for each node or tet, the same fields with each frame.
    void append_field(const std::string& name, FieldPlace place, int components,
                      std::span<const double> values);
    /// Numbers belonging to the frame last appended, under a name of their own: as many with each
    /// frame.
    void append_values(const std::string& name, std::span<const double> values);
    /// A row of a table that grows as it will, under a name of its own: as many numbers with each.
    void append_row(const std::string& name, std::span<const double> row);
    /// A text about the run as a whole, under a name of its own.
    void write_text(const std::string& name, const std::string& text);
    void flush();
    void close();

    std::size_t frame_count() const { return times_.size(); }

  private:
    std::filesystem::path path_;
    std::unique_ptr<PendingFile> pending_;  // the first rank's
    std::unique_ptr<hdf5::File>
        file_;  // after pending_: closed before a file without `close` is removed
    struct Field {
        std::string name;
        FieldPlace place;
        int components;
    };
    std::string xdmf() const;
    /// A table that grows, and its rows that are not in the file yet: each goes there through a
    /// dozen calls of HDF5, so many go together.
    struct GrowingTable {
        std::string name;
        std::size_t columns;
        std::size_t rows = 0;  ///< with those
        std::vector<double> waiting{};
    };
    GrowingTable& growing(const std::string& name, std::size_t columns);
    void add_row(GrowingTable& table, std::span<const double> row);
    void write_waiting(GrowingTable& table);

    std::map<std::string, GrowingTable> tables_;
    std::size_t nodes_, tets_;
    bool regions_, quadratic_;
    std::vector<Field> fields_;
    std::vector<double> times_;
    Precision precision_;
    std::vector<float> row_;  ///< of single precision
};

/// Reads what ResultWriter wrote. Throws Error, naming file and table, where it does not hold
/// together.
class ResultReader {
  public:
    explicit ResultReader(const std::filesystem::path& path);

    const TetMesh& mesh() const { return mesh_; }
    const std::string& scene_text() const { return scene_text_; }
    bool has_text(const std::string& name) const { return file_.has("texts/" + name); }
    /// A text given to `write_text`. Throws Error where there is none of that name.
    std::string text(const std::string& name) const { return file_.read_text("texts/" + name); }
    const std::vector<double>& times_s() const { return times_; }
    std::size_t frame_count() const { return times_.size(); }
    /// The displacement of frame k, in metres.
    std::vector<Vector3> displacement(std::size_t k) const;
    /// A field of frame k under a name given to `append_field`.
    std::vector<double> field(const std::string& name, std::size_t k, int components) const;
    /// The values of frame k under a name given to `append_values`, `count` of them.
    std::vector<double> values(const std::string& name, std::size_t k, std::size_t count) const;
    /// All rows given to `append_row` under a name, one behind the other. Throws Error where there
    /// is no such table.
    std::vector<double> rows(const std::string& name, std::size_t columns) const {
        return file_.read<double>("rows/" + name, columns).values;
    }
    std::vector<std::string> value_names() const { return file_.names("values"); }
    std::vector<std::string> field_names() const { return file_.names("fields"); }

  private:
    hdf5::File file_;
    TetMesh mesh_;
    std::string scene_text_;
    std::vector<double> times_;
};

}  // namespace livetet
