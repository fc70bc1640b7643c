#pragma once

#include <mpi.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/row_range.hpp"

namespace livetet::hdf5 {

/// Owns an HDF5 identifier of any kind. A moved-from handle is empty.
class Handle {
  public:
    using Id = std::int64_t;
    using Close = int (*)(Id);
    Handle() = default;
    Handle(Id id, Close close) : id_(id), close_(close) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        std::swap(close_, other.close_);
        return *this;
    }
    ~Handle() {
        if (id_ >= 0) close_(id_);
    }
    Id id() const { return id_; }

  private:
    Id id_ = -1;
    Close close_ = nullptr;
};

/// A table read from a file; `values` is row-major.
template <class T>
struct Table {
    std::size_t rows = 0;
    std::vector<T> values;
};

/// Whether a file is checked for damage when it is opened, or was checked before.
enum class Validation { now, done };

/// An HDF5 file with tables of numbers and texts in groups ("/levels/0/nodes"). Writing creates
/// missing groups. T is double, float or std::int32_t. Every failure throws an Error that names the
/// file and the table.
class File {
  public:
    /// Creates a file. `shown` is its name in messages. With a communicator of several ranks, they
    /// write one file collectively (MPI-IO): every rank calls the member functions below in the
    /// same order with the same values, and writes its share of the rows.
    static File create(const std::filesystem::path& path, const std::string& shown,
                       MPI_Comm comm = MPI_COMM_SELF);
    /// Opens a file for reading. HDF5 may crash on damaged files, so by default a child process
    /// first reads all groups and tables (milliseconds). Validation::done skips that for files that
    /// passed `check`.
    static File open(const std::filesystem::path& path, Validation validation = Validation::now);
    /// Checks many files in one child process. Throws Error naming the first damaged one.
    static void check(const std::vector<std::filesystem::path>& paths);

    /// Writes a table; `values` is row-major.
    template <class T>
    void write(const std::string& name, std::span<const T> values, std::size_t columns);
    /// The same of a table of `rows`, of which each rank has its share alone (see `share_of`).
    template <class T>
    void write_share(const std::string& name, std::size_t rows, std::span<const T> mine,
                     std::size_t columns);
    /// The same of a table of which each rank has some rows, those of lower ranks first.
    template <class T>
    void write_parts(const std::string& name, std::span<const T> mine, std::size_t columns);
    /// The sum over the ranks that write the file.
    std::size_t sum(std::size_t here) const;
    /// This rank's share of the rows.
    RowRange share_of(std::size_t rows) const { return row_range(rows, rank_, ranks_); }
    /// Work of each rank, without messages. If it throws on one, all throw the first one's error.
    void together(const std::function<void()>& work) const;
    /// Reads a table with `columns` columns, of any numeric type that HDF5 converts.
    template <class T>
    Table<T> read(const std::string& name, std::size_t columns) const;
    /// Reads some of its rows.
    template <class T>
    std::vector<T> read_range(const std::string& name, RowRange range, std::size_t columns) const;

    /// Creates an empty table that `write_rows` extends.
    template <class T>
    void create_growing(const std::string& name, std::size_t columns);
    /// Writes rows from number `first` on. Overwrites existing rows and extends the table as
    /// needed.
    template <class T>
    void write_rows(const std::string& name, std::size_t first, std::span<const T> values,
                    std::size_t columns);
    std::size_t rows(const std::string& name, std::size_t columns) const;
    /// Reads one row.
    template <class T>
    std::vector<T> read_row(const std::string& name, std::size_t row, std::size_t columns) const;

    bool has(const std::string& name) const;
    /// The names in a group, sorted; empty if the group does not exist.
    std::vector<std::string> names(const std::string& group) const;

    /// Texts of the file.
    void write_text(const std::string& name, const std::string& text);
    std::string read_text(const std::string& name) const;

    /// Flushes the file, so that it stays readable if the program is killed.
    void flush();
    /// Reserves disk space for `bytes` after the last table. Returns false, on every rank, if there
    /// is none. This detects a full disk while the file is consistent. On a full disk within a
    /// write, HDF5 may crash and collective writers may deadlock. Include growing tables, texts and
    /// HDF5's own data in `bytes`.
    bool reserve(std::size_t bytes);
    /// Releases reserved space that was not used. Call `flush` before (collective files are already
    /// flushed by HDF5).
    void give_back();
    const std::string& shown() const { return shown_; }

  private:
    File(Handle file, std::string shown) : file_(std::move(file)), shown_(std::move(shown)) {}
    Handle dataset(const std::string& name) const;
    /// Writes some of a new table's rows, those from number `first` on.
    template <class T>
    void write_some(const std::string& name, std::size_t rows, std::size_t first,
                    std::span<const T> mine, std::size_t columns);
    /// Reads everything in a group that any later access could interpret.
    static File open_here(const std::filesystem::path& path);
    void go_through(const std::string& group, int depth) const;
    Handle file_;
    std::string shown_;
    Handle descriptor_;  ///< of the same file, for `reserve` on the first rank
    MPI_Comm comm_ = MPI_COMM_SELF;
    std::size_t end_ = 0;  ///< end of the last table in the file, bytes
    std::size_t rank_ = 0, ranks_ = 1;
};

/// Write and check the texts that identify a file: "livetet_format" and "livetet_version".
void write_format(File& file, const std::string& format, int version);
void check_format(const File& file, const std::string& format, int version);

/// Writes a file with these marks atomically (PendingFile): `fill` writes its contents of about
/// `bytes`. Reserves the space first, as HDF5 cannot close a file on a full disk, and MPI_Finalize
/// then crashes. The ranks of a communicator write it together.
void write_whole(const std::filesystem::path& path, const std::string& format, int version,
                 std::size_t bytes, const std::function<void(File&)>& fill,
                 MPI_Comm comm = MPI_COMM_SELF);

/// Begins a file that the ranks of a communicator will write together: on the first rank the
/// temporary file, null on the others, and its name on all.
std::pair<std::unique_ptr<PendingFile>, std::string> begin_pending(
    const std::filesystem::path& path, MPI_Comm comm);

}  // namespace livetet::hdf5
