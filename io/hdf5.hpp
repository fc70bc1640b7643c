#pragma once

#include <mpi.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace livetet::hdf5 {

/// Owns one HDF5 identifier of whatever kind. A moved-from handle is empty.
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

/// A table read from a file: `columns` values to a row.
template <class T>
struct Table {
    std::size_t rows = 0;
    std::vector<T> values;
};

/// An HDF5 file of tables of numbers and texts in groups ("/levels/0/nodes"); a group is made when
/// something is written into it. T is double, float or std::int32_t. Every failure is an Error that
/// names the file and the table.
class File {
  public:
    /// Makes a new file. `shown` is the name that messages give it. With a communicator of several
    /// ranks they write one file together (MPI-IO): each calls all of what follows alike and has
    /// all of the values; each writes a share of the rows.
    static File create(const std::filesystem::path& path, const std::string& shown,
                       MPI_Comm comm = MPI_COMM_SELF);
    /// Opens a file to read. HDF5 crashes on damaged ones: a child process has gone through all of
    /// its groups and tables before this one touches it, which takes milliseconds; not where that
    /// was done by `check` (`is_checked`).
    static File open(const std::filesystem::path& path, bool is_checked = false);
    /// The same look at many files, by one child process for all. Throws Error that names the first
    /// damaged one.
    static void check(const std::vector<std::filesystem::path>& paths);

    /// Writes rows x columns values by rows.
    template <class T>
    void write(const std::string& name, std::span<const T> values, std::size_t columns);
    /// Reads a table that must have `columns` values to a row, of any numeric type that HDF5
    /// converts.
    template <class T>
    Table<T> read(const std::string& name, std::size_t columns) const;

    /// A table that grows by rows of `columns` values.
    template <class T>
    void create_growing(const std::string& name, std::size_t columns);
    /// Rows from number `first` on: what stands there is written over, the table grows to hold
    /// them.
    template <class T>
    void write_rows(const std::string& name, std::size_t first, std::span<const T> values,
                    std::size_t columns);
    std::size_t rows(const std::string& name, std::size_t columns) const;
    /// Row `row` alone.
    template <class T>
    std::vector<T> read_row(const std::string& name, std::size_t row, std::size_t columns) const;

    bool has(const std::string& name) const;
    /// The names in a group, sorted; none where there is no such group.
    std::vector<std::string> names(const std::string& group) const;

    /// Texts belonging to the file as a whole.
    void write_text(const std::string& name, const std::string& text);
    std::string read_text(const std::string& name) const;

    /// All that was written so far is on its way to the disk: the file is whole should the program
    /// be killed.
    void flush();
    /// Takes disk space for so many bytes behind the last table ahead of their being written;
    /// false, on every rank, where there is none. A disk that is full is met here, where the file
    /// is whole, and not within a table: HDF5 may then crash, and ranks that write together wait
    /// for each other for ever. Tables that grow, texts and HDF5's own are to be counted in.
    bool reserve(std::size_t bytes);
    /// Gives back what was reserved and not used. For a file that was flushed (of several ranks
    /// HDF5 has done so by then).
    void give_back();
    const std::string& shown() const { return shown_; }

  private:
    File(Handle file, std::string shown) : file_(std::move(file)), shown_(std::move(shown)) {}
    Handle dataset(const std::string& name) const;
    /// Has HDF5 interpret all that it does for any reading of what is in a group.
    static File open_here(const std::filesystem::path& path);
    void go_through(const std::string& group, int depth) const;
    /// This rank's share of so many rows: from the first to before the last.
    std::pair<std::size_t, std::size_t> share_of(std::size_t rows) const {
        return {rows * rank_ / ranks_, rows * (rank_ + 1) / ranks_};
    }
    Handle file_;
    std::string shown_;
    Handle descriptor_;  ///< of the same file, where the first rank reserves
    MPI_Comm comm_ = MPI_COMM_SELF;
    std::size_t end_ = 0;  ///< of the table that ends last in the file, bytes
    std::size_t rank_ = 0, ranks_ = 1;
};

/// Writes and checks the marks that say what a file is: "livetet_format" and "livetet_version".
void write_format(File& file, const std::string& format, int version);
void check_format(const File& file, const std::string& format, int version);

/// A file with these marks that `fill` writes, of about `bytes`: whole or not at all (PendingFile).
/// The room for it is taken before: a file that HDF5 cannot close on a full disk stays open in it,
/// and MPI's end crashes there.
void write_whole(const std::filesystem::path& path, const std::string& format, int version,
                 std::size_t bytes, const std::function<void(File&)>& fill);

}  // namespace livetet::hdf5
