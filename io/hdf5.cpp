#include "io/hdf5.hpp"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <thread>
#include <type_traits>

#include "base/child_process.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/together.hpp"
#include "io/parse_in_child.hpp"

namespace livetet::hdf5 {

namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>, "HDF5 1.10 or later");

/// Turns off HDF5's error output, since Errors carry the messages. Also keeps HDF5 from retrying
/// failed writes at exit, where it would crash on a full disk.
void begin() {
    static const herr_t not_at_exit = H5dont_atexit();
    (void)not_at_exit;
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

template <class T>
hid_t memory_type() {
    if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
    if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
    if constexpr (std::is_same_v<T, std::int32_t>) return H5T_NATIVE_INT32;
}

/// Little-endian types in files, on any machine.
template <class T>
hid_t stored_type() {
    if constexpr (std::is_same_v<T, double>) return H5T_IEEE_F64LE;
    if constexpr (std::is_same_v<T, float>) return H5T_IEEE_F32LE;
    if constexpr (std::is_same_v<T, std::int32_t>) return H5T_STD_I32LE;
}

Handle space_of(std::size_t rows, std::size_t columns, bool growing = false) {
    const hsize_t size[2] = {rows, columns}, max_size[2] = {H5S_UNLIMITED, columns};
    return {H5Screate_simple(2, size, growing ? max_size : nullptr), H5Sclose};
}

Handle with_groups() {
    Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links.id(), 1);
    return links;
}

/// Number of rows of a two-dimensional table with `columns` columns; throws Error for anything
/// else.
std::size_t rows_of(const Handle& dataset, std::size_t columns, const std::string& where,
                    bool integers) {
    const Handle space(H5Dget_space(dataset.id()), H5Sclose);
    const Handle type(H5Dget_type(dataset.id()), H5Tclose);
    hsize_t size[2] = {0, 0};
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (rank == 2) H5Sget_simple_extent_dims(space.id(), size, nullptr);
    if (rank != 2 || size[1] != columns)
        fail("{}: found {} dimensions with {} columns, expected a table of {} columns", where, rank,
             size[1], columns);
    const auto kind = H5Tget_class(type.id());
    if (kind != H5T_INTEGER && (integers || kind != H5T_FLOAT))
        fail("{}: found other data, expected {}", where, integers ? "whole numbers" : "numbers");
    constexpr hsize_t max_rows = std::numeric_limits<std::int32_t>::max();
    if (size[0] > max_rows)
        fail("{}: found {} rows, expected at most {}", where, size[0], max_rows);
    return size[0];
}

/// Whether the file stores this many values, uncompressed. Bounds the memory that a wrong size can
/// request, and prevents HDF5 from reading beyond its buffers.
bool is_stored(const Handle& dataset, std::size_t values) {
    const Handle type(H5Dget_type(dataset.id()), H5Tclose);
    const std::size_t size = H5Tget_size(type.id());
    return size > 0 && H5Dget_storage_size(dataset.id()) / size >= values;
}

int close_descriptor(Handle::Id descriptor) { return ::close(static_cast<int>(descriptor)); }

Handle create_empty(const std::filesystem::path& path, const std::string& shown) {
    const int found = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (found < 0) fail("{}: cannot be written: {}", shown, std::strerror(errno));
    return Handle(found, close_descriptor);
}

/// Throws Error if this rank does not find the file that the first has made: with Open MPI's files
/// the others would wait forever for a rank that cannot open one. A network's file system may show
/// it some time later.
void expect_seen(const std::filesystem::path& path, const std::string& shown, int rank) {
    constexpr std::chrono::seconds longest(3);
    const auto start = std::chrono::steady_clock::now();
    for (;;) {
        const int found = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (found >= 0) {
            ::close(found);
            return;
        }
        const int reason = errno;
        if (reason != ENOENT || std::chrono::steady_clock::now() - start > longest)
            fail("{}: cannot be written by rank {}: {}, expected a folder that all ranks share",
                 shown, rank, std::strerror(reason));
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}

}  // namespace

void File::together(const std::function<void()>& work) const {
    livetet::together(ranks_ > 1 ? comm_ : MPI_COMM_SELF, work);
}

std::size_t File::sum(std::size_t here) const {
    std::uint64_t all = here;
    if (ranks_ > 1) MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_UINT64_T, MPI_SUM, comm_);
    return all;
}

File File::create(const std::filesystem::path& path, const std::string& shown, MPI_Comm comm) {
    begin();
    int rank = 0, ranks = 1;
    if (comm != MPI_COMM_SELF) {  // a single writer need not have MPI
        MPI_Comm_rank(comm, &rank);
        MPI_Comm_size(comm, &ranks);
    }
    Handle descriptor;
    livetet::together(comm, [&] {
        if (rank == 0) descriptor = create_empty(path, shown);
    });
    livetet::together(comm, [&] { expect_seen(path, shown, rank); });
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    if (ranks > 1) H5Pset_fapl_mpio(access.id(), comm, MPI_INFO_NULL);
    Handle handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
    livetet::together(comm, [&] {
        if (handle.id() < 0) fail("{}: cannot be written as HDF5 (is the disk full?)", shown);
    });
    File file(std::move(handle), shown);
    file.descriptor_ = std::move(descriptor);
    file.comm_ = comm;
    file.rank_ = static_cast<std::size_t>(rank);
    file.ranks_ = static_cast<std::size_t>(ranks);
    return file;
}

File File::open_here(const std::filesystem::path& path) {
    Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (file.id() < 0) fail("{}: is not an HDF5 file, or is truncated", path.string());
    return File(std::move(file), path.string());
}

File File::open(const std::filesystem::path& path, Validation validation) {
    begin();
    check_is_file(path);
    const auto look = [&] {
        open_here(path).go_through("", 0);
        return std::vector<char>();
    };
    if (validation == Validation::now) parse_in_child(path, "HDF5", look);
    return open_here(path);
}

void File::check(const std::vector<std::filesystem::path>& paths) {
    begin();
    std::error_code ignored;
    double enough_s = 5;
    for (const std::filesystem::path& path : paths) {
        const auto size = std::filesystem::file_size(path, ignored);
        enough_s += 0.1 + (ignored ? 0 : 2e-6 * static_cast<double>(size));
    }
    const auto look = [&](int) {
        limit_processor_time(enough_s);
        limit_memory(std::uint64_t(2) << 30);
        for (const std::filesystem::path& path : paths) open_here(path).go_through("", 0);
        return 0;
    };
    if (run_in_child(look, 20 * enough_s).end == ChildResult::End::returned) return;
    for (const std::filesystem::path& path : paths) (void)open(path);
}

void File::go_through(const std::string& group, int depth) const {
    constexpr int deepest = 8;  // our files have four; links may form a cycle
    if (depth > deepest) fail("{}: has groups within groups deeper than {}", shown_, deepest);
    (void)has(group + "/?");  // lookup takes another path through HDF5 than listing
    for (const std::string& name : names(group.empty() ? "/" : group)) {
        const std::string path = group + '/' + name;
        const Handle object(has(path) ? H5Oopen(file_.id(), path.c_str(), H5P_DEFAULT) : -1,
                            H5Oclose);
        if (H5Iget_type(object.id()) == H5I_GROUP) go_through(path, depth + 1);
        if (H5Iget_type(object.id()) != H5I_DATASET) continue;
        const Handle type(H5Dget_type(object.id()), H5Tclose),
            space(H5Dget_space(object.id()), H5Sclose);
        hsize_t size[H5S_MAX_RANK] = {0};
        const int rank = H5Sget_simple_extent_ndims(space.id());
        H5Sget_simple_extent_dims(space.id(), size, nullptr);
        try {
            if (H5Tget_class(type.id()) == H5T_STRING) read_text(path);
            if (rank == 2 && size[0] > 0) read_row<double>(path, size[0] - 1, size[1]);
        } catch (const Error&) {  // reported when the table is used
        }
    }
}

Handle File::dataset(const std::string& name) const {
    Handle handle(has(name) ? H5Dopen2(file_.id(), name.c_str(), H5P_DEFAULT) : -1, H5Dclose);
    if (handle.id() < 0) fail("{}: holds no table {}", shown_, name);
    return handle;
}

template <class T>
void File::write(const std::string& name, std::span<const T> values, std::size_t columns) {
    const std::size_t rows = values.size() / columns;
    const RowRange mine = share_of(rows);
    write_share(name, rows, values.subspan(mine.first * columns, mine.size() * columns), columns);
}

template <class T>
void File::write_share(const std::string& name, std::size_t rows, std::span<const T> values,
                       std::size_t columns) {
    const RowRange share = share_of(rows);
    if (values.size() != share.size() * columns)
        fail("{}: table {}: found {} numbers on a rank, expected {} for each of {} rows", shown_,
             name, values.size(), columns, share.size());
    write_some(name, rows, share.first, values, columns);
}

template <class T>
void File::write_parts(const std::string& name, std::span<const T> mine, std::size_t columns) {
    std::uint64_t here = mine.size() / columns, end = here;
    if (ranks_ > 1) MPI_Scan(&here, &end, 1, MPI_UINT64_T, MPI_SUM, comm_);
    write_some(name, sum(here), end - here, mine, columns);
}

template <class T>
void File::write_some(const std::string& name, std::size_t rows, std::size_t first,
                      std::span<const T> values, std::size_t columns) {
    const std::size_t count_here = values.size() / columns;
    const Handle links = with_groups(), space = space_of(rows, columns);
    const Handle data(H5Dcreate2(file_.id(), name.c_str(), stored_type<T>(), space.id(), links.id(),
                                 H5P_DEFAULT, H5P_DEFAULT),
                      H5Dclose);
    const Handle mine = space_of(rows, columns), memory = space_of(count_here, columns);
    const hsize_t start[2] = {first, 0}, count[2] = {count_here, columns};
    const bool bad =
        data.id() < 0 || (count_here > 0 && (H5Sselect_hyperslab(mine.id(), H5S_SELECT_SET, start,
                                                                 nullptr, count, nullptr) < 0 ||
                                             H5Dwrite(data.id(), memory_type<T>(), memory.id(),
                                                      mine.id(), H5P_DEFAULT, values.data()) < 0));
    if (bad) fail("{}: the table {} cannot be written (is the disk full?)", shown_, name);
    if (const haddr_t place = H5Dget_offset(data.id()); place != HADDR_UNDEF)
        end_ = std::max<std::size_t>(end_, place + H5Dget_storage_size(data.id()));
}

template <class T>
Table<T> File::read(const std::string& name, std::size_t columns) const {
    const std::string where = fmt::format("{}: table {}", shown_, name);
    const Handle data = dataset(name);
    Table<T> table{rows_of(data, columns, where, std::is_integral_v<T>), {}};
    if (!is_stored(data, table.rows * columns))
        fail("{}: its {} rows are not in the file: truncated", where, table.rows);
    table.values.resize(table.rows * columns);
    if (table.rows > 0 && H5Dread(data.id(), memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                                  table.values.data()) < 0)
        fail("{}: cannot be read: damaged or truncated", where);
    return table;
}

template <class T>
void File::create_growing(const std::string& name, std::size_t columns) {
    const Handle links = with_groups(), space = space_of(0, columns, true);
    const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    const hsize_t chunk[2] = {std::max<hsize_t>(1, 65536 / (columns * sizeof(T))), columns};
    H5Pset_chunk(layout.id(), 2, chunk);
    const Handle data(H5Dcreate2(file_.id(), name.c_str(), stored_type<T>(), space.id(), links.id(),
                                 layout.id(), H5P_DEFAULT),
                      H5Dclose);
    if (data.id() < 0) fail("{}: the table {} cannot be made", shown_, name);
}

template <class T>
void File::write_rows(const std::string& name, std::size_t first, std::span<const T> values,
                      std::size_t columns) {
    const Handle data = dataset(name);
    const std::size_t more = values.size() / columns;
    const hsize_t size[2] = {std::max(rows(name, columns), first + more), columns},
                  start[2] = {first, 0}, count[2] = {more, columns};
    bool bad = H5Dset_extent(data.id(), size) < 0;
    const Handle space(H5Dget_space(data.id()), H5Sclose), memory = space_of(more, columns);
    bad = bad ||
          H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start, nullptr, count, nullptr) < 0 ||
          (rank_ == 0 && H5Dwrite(data.id(), memory_type<T>(), memory.id(), space.id(), H5P_DEFAULT,
                                  values.data()) < 0);
    if (bad)
        fail("{}: row {} of the table {} cannot be written (is the disk full?)", shown_, first,
             name);
}

std::size_t File::rows(const std::string& name, std::size_t columns) const {
    return rows_of(dataset(name), columns, fmt::format("{}: table {}", shown_, name), false);
}

template <class T>
std::vector<T> File::read_range(const std::string& name, RowRange range,
                                std::size_t columns) const {
    const Handle data = dataset(name);
    const std::size_t found = rows(name, columns);
    if (!is_stored(data, found * columns))
        fail("{}: table {}: its {} rows are not in the file: truncated", shown_, name, found);
    if (range.first > range.end || range.end > found)
        fail("{}: table {} has {} rows, expected one of number {}", shown_, name, found,
             range.end - 1);
    std::vector<T> values(range.size() * columns);
    if (values.empty()) return values;
    const hsize_t start[2] = {range.first, 0}, count[2] = {range.size(), columns};
    const Handle space(H5Dget_space(data.id()), H5Sclose), memory = space_of(range.size(), columns);
    if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, start, nullptr, count, nullptr) < 0 ||
        H5Dread(data.id(), memory_type<T>(), memory.id(), space.id(), H5P_DEFAULT, values.data()) <
            0)
        fail("{}: row {} of table {} cannot be read: damaged or truncated", shown_, range.first,
             name);
    return values;
}

template <class T>
std::vector<T> File::read_row(const std::string& name, std::size_t row, std::size_t columns) const {
    return read_range<T>(name, {row, row + 1}, columns);
}

bool File::has(const std::string& name) const {
    // H5Lexists requires that each parent group be tested first.
    for (std::size_t bar = name.find('/', 1);; bar = name.find('/', bar + 1)) {
        if (H5Lexists(file_.id(), name.substr(0, bar).c_str(), H5P_DEFAULT) <= 0) return false;
        if (bar == std::string::npos) return true;
    }
}

std::vector<std::string> File::names(const std::string& group) const {
    std::vector<std::string> names;
    const Handle handle(has(group) ? H5Gopen2(file_.id(), group.c_str(), H5P_DEFAULT) : -1,
                        H5Gclose);
    H5G_info_t info{};
    if (handle.id() < 0 || H5Gget_info(handle.id(), &info) < 0) return names;
    for (hsize_t i = 0; i < info.nlinks; ++i) {
        char text[1024] = {};
        if (H5Lget_name_by_idx(handle.id(), ".", H5_INDEX_NAME, H5_ITER_INC, i, text, sizeof text,
                               H5P_DEFAULT) < 0)
            fail("{}: the group {} cannot be read: damaged", shown_, group);
        names.emplace_back(text);
    }
    std::sort(names.begin(), names.end());
    return names;
}

void File::write_text(const std::string& name, const std::string& text) {
    // A data set, not an attribute: attributes are limited to 64 kB, which a scene or a provenance
    // may exceed.
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose),
        links = with_groups();
    H5Tset_size(type.id(), text.size() + 1);
    H5Tset_cset(type.id(), H5T_CSET_UTF8);
    const Handle data(H5Dcreate2(file_.id(), name.c_str(), type.id(), space.id(), links.id(),
                                 H5P_DEFAULT, H5P_DEFAULT),
                      H5Dclose);
    if (data.id() < 0 || (rank_ == 0 && H5Dwrite(data.id(), type.id(), H5S_ALL, H5S_ALL,
                                                 H5P_DEFAULT, text.c_str()) < 0))
        fail("{}: the text {} cannot be written (is the disk full?)", shown_, name);
}

std::string File::read_text(const std::string& name) const {
    const Handle data = dataset(name);
    const Handle type(H5Dget_type(data.id()), H5Tclose), space(H5Dget_space(data.id()), H5Sclose);
    const std::size_t size = H5Tget_size(type.id());
    if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) != 0 ||
        size > (1u << 28) || H5Sget_simple_extent_npoints(space.id()) != 1)
        fail("{}: {} is not a text", shown_, name);
    if (!is_stored(data, 1)) fail("{}: the text {} is not in the file: truncated", shown_, name);
    std::string text(size, '\0');
    if (H5Dread(data.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0)
        fail("{}: the text {} cannot be read: damaged or truncated", shown_, name);
    text.resize(std::min(text.find('\0'), text.size()));
    return text;
}

void File::flush() {
    if (H5Fflush(file_.id(), H5F_SCOPE_LOCAL) < 0)
        fail("{}: cannot be written (is the disk full?)", shown_);
}

bool File::reserve(std::size_t bytes) {
    const int descriptor = static_cast<int>(descriptor_.id());
    const off_t end = static_cast<off_t>(end_), more = static_cast<off_t>(bytes);
    const auto take = [&](off_t wanted) {
        while (::fallocate(descriptor, 0, end, wanted) != 0) {
            if (errno == EINTR) continue;
            struct statvfs disk {};
            // Some file systems cannot reserve space: then check the free space.
            const bool cannot = errno == EOPNOTSUPP || errno == ENOSYS;
            return cannot && ::fstatvfs(descriptor, &disk) == 0 &&
                   disk.f_bavail * disk.f_frsize >= static_cast<std::uint64_t>(wanted);
        }
        return true;
    };
    struct stat now {};
    const bool there = rank_ == 0 && ::fstat(descriptor, &now) == 0 && now.st_size >= end + more;
    // Twice the size if possible, so that the next call finds its space reserved.
    int taken = rank_ == 0 && (there || take(2 * more) || take(more));
    if (ranks_ > 1) MPI_Bcast(&taken, 1, MPI_INT, 0, comm_);
    return taken != 0;
}

void File::give_back() {
    if (ranks_ > 1) return;
    hsize_t size = 0;
    if (H5Fget_filesize(file_.id(), &size) < 0 ||
        ::ftruncate(static_cast<int>(descriptor_.id()), static_cast<off_t>(size)) != 0)
        fail("{}: cannot be written (is the disk full?)", shown_);
}

void write_format(File& file, const std::string& format, int version) {
    file.write_text("livetet_format", format);
    const std::int32_t number = version;
    file.write<std::int32_t>("livetet_version", {&number, 1}, 1);
}

void check_format(const File& file, const std::string& format, int version) {
    if (!file.has("livetet_format"))
        fail(
            "{}: is an HDF5 file of another program, or damaged: found no livetet_format, expected "
            "{}",
            file.shown(), format);
    const std::string found = file.read_text("livetet_format");
    if (found != format) fail("{}: holds {}, expected {}", file.shown(), found, format);
    const auto number = file.read<std::int32_t>("livetet_version", 1);
    if (number.rows != 1 || number.values[0] != version)
        fail("{}: holds version {} of {}, expected {}", file.shown(),
             number.rows ? number.values[0] : 0, format, version);
}

#define LIVETET_HDF5_OF(T)                                                                        \
    template void File::write<T>(const std::string&, std::span<const T>, std::size_t);            \
    template Table<T> File::read<T>(const std::string&, std::size_t) const;                       \
    template void File::create_growing<T>(const std::string&, std::size_t);                       \
    template void File::write_rows<T>(const std::string&, std::size_t, std::span<const T>,        \
                                      std::size_t);                                               \
    template void File::write_parts<T>(const std::string&, std::span<const T>, std::size_t);      \
    template void File::write_share<T>(const std::string&, std::size_t, std::span<const T>,       \
                                       std::size_t);                                              \
    template std::vector<T> File::read_range<T>(const std::string&, RowRange, std::size_t) const; \
    template std::vector<T> File::read_row<T>(const std::string&, std::size_t, std::size_t) const;
LIVETET_HDF5_OF(double)
LIVETET_HDF5_OF(float)
LIVETET_HDF5_OF(std::int32_t)
#undef LIVETET_HDF5_OF

std::pair<std::unique_ptr<PendingFile>, std::string> begin_pending(
    const std::filesystem::path& path, MPI_Comm comm) {
    const bool has_others = comm != MPI_COMM_SELF;
    int rank = 0;
    if (has_others) MPI_Comm_rank(comm, &rank);
    std::unique_ptr<PendingFile> pending;
    together(comm, [&] {
        if (rank == 0) pending = std::make_unique<PendingFile>(path);
    });
    std::string temporary = pending ? pending->path().string() : "";
    if (has_others) {
        auto length = static_cast<int>(temporary.size());
        MPI_Bcast(&length, 1, MPI_INT, 0, comm);
        temporary.resize(static_cast<std::size_t>(length));
        MPI_Bcast(temporary.data(), length, MPI_CHAR, 0, comm);
    }
    return {std::move(pending), std::move(temporary)};
}

void write_whole(const std::filesystem::path& path, const std::string& format, int version,
                 std::size_t bytes, const std::function<void(File&)>& fill, MPI_Comm comm) {
    // HDF5's own data, and what it needs to close the file on a full disk.
    constexpr std::size_t room_beside = 1 << 20;
    const auto [pending, temporary] = begin_pending(path, comm);
    {
        File file = File::create(temporary, path.string(), comm);
        if (!file.reserve(bytes + room_beside))
            fail("{}: cannot be written (is the disk full?)", path.string());
        write_format(file, format, version);
        fill(file);
        file.flush();
        file.give_back();
    }
    together(comm, [&] {
        if (pending) pending->commit();
    });
}

}  // namespace livetet::hdf5
