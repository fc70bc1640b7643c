#include "base/file.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <system_error>

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/pending_folder.hpp"

namespace livetet {

namespace fs = std::filesystem;

void check_is_file(const fs::path& path) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) fail("{}: is a folder, expected a file", path.string());
    if (!fs::is_regular_file(path, ignored)) fail("{}: no such file", path.string());
}

std::string read_text_file(const fs::path& path) {
    std::error_code ignored;
    if (!fs::exists(path, ignored)) fail("{}: no such file", path.string());
    if (fs::is_directory(path, ignored)) fail("{}: is a folder, expected a file", path.string());
    // /dev/zero has no end.
    if (fs::is_character_file(path, ignored) && !fs::equivalent(path, "/dev/null", ignored))
        fail("{}: is a device, expected a file", path.string());
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) fail("{}: cannot be read", path.string());
    return text.str();
}

std::string digest(std::string_view contents) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : contents) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    return fmt::format("{:016x}", hash);
}

bool same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
    if (a.empty() || b.empty()) return false;
    // A path may be too long for the system, or in a folder that may not be searched.
    std::error_code error;
    const fs::path of_a = fs::weakly_canonical(a, error),
                   of_b = error ? fs::path() : fs::weakly_canonical(b, error);
    return error ? a.lexically_normal() == b.lexically_normal() : of_a == of_b;
}

namespace {

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Flushes a file's data, or a folder's renames, to the disk. Returns the error number if the disk
/// fails; 0 also if the file system does not support it.
int reach_the_disk(const fs::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return errno;
    const int error =
        ::fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP ? 0
                                                                                          : errno;
    ::close(descriptor);
    return error;
}

/// The temporary name of `target`, in its folder. Throws Error if that folder does not exist or is
/// not writable.
fs::path part_beside(const fs::path& target) {
    const fs::path folder = folder_of(target);
    std::error_code error;
    if (!fs::is_directory(folder, error))
        fail("{}: cannot be written, there is no folder {}", target.string(), folder.string());
    if (::access(folder.c_str(), W_OK) != 0)
        fail("{}: cannot be written, the folder {} is not writable", target.string(),
             folder.string());
    return folder / fmt::format(".{}.part{}{}", target.stem().string(), ::getpid(),
                                target.extension().string());
}

/// Flushes a written file or folder. Throws Error, naming `target`, if the disk fails.
void expect_on_disk(const fs::path& written, const fs::path& target) {
    if (const int reason = reach_the_disk(written); reason != 0)
        fail("{}: cannot be written: {} (is the disk full?)", target.string(),
             std::generic_category().message(reason));
}

}  // namespace

PendingFile::PendingFile(fs::path target) : target_(std::move(target)) {
    std::error_code error;
    if (fs::is_directory(target_, error))
        fail("{}: is a folder, expected the name of a file to write", target_.string());
    temporary_ = part_beside(target_);
    signal_guard_.emplace(temporary_);
}

PendingFile::~PendingFile() {
    std::error_code ignored;
    if (!committed_) fs::remove(temporary_, ignored);
}

void PendingFile::commit() {
    std::error_code error;
    // Flush before the rename, so that after a crash of the machine either the old file or the new
    // one is whole.
    expect_on_disk(temporary_, target_);
    fs::rename(temporary_, target_, error);
    if (error) fail("{}: cannot be written: {}", target_.string(), error.message());
    committed_ = true;
    (void)reach_the_disk(folder_of(target_));
}

void expect_writable(const fs::path& target) { const PendingFile begun(target); }

PendingFolder::PendingFolder(fs::path target)
    : target_(target.has_relative_path() && !target.has_filename() ? target.parent_path()
                                                                   : std::move(target)) {
    std::error_code error;
    if (fs::exists(target_, error) && !fs::is_directory(target_, error))
        fail("{}: is a file, expected the name of a folder to write", target_.string());
    if (fs::is_directory(target_, error) && !fs::is_empty(target_, error))
        fail("{}: is a folder that holds files, expected a new or an empty one", target_.string());
    temporary_ = part_beside(target_);
    signal_guard_.emplace(temporary_);
    if (!fs::create_directory(temporary_, error))
        fail("{}: cannot be written: {}", target_.string(),
             error ? error.message() : temporary_.string() + " exists");
}

PendingFolder::~PendingFolder() {
    std::error_code ignored;
    if (!committed_) fs::remove_all(temporary_, ignored);
}

void PendingFolder::commit() {
    for (const fs::directory_entry& entry : fs::directory_iterator(temporary_))
        expect_on_disk(entry.path(), target_);
    std::error_code error;
    fs::rename(temporary_, target_, error);  // replaces an empty folder
    if (error) fail("{}: cannot be written: {}", target_.string(), error.message());
    committed_ = true;
    (void)reach_the_disk(folder_of(target_));
}

std::vector<fs::path> left_parts(const fs::path& target) {
    const std::string begin = fmt::format(".{}.part", target.stem().string());
    const std::string end = target.extension().string();
    std::vector<fs::path> parts;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_of(target), ignored)) {
        std::string_view name = entry.path().native();
        name.remove_prefix(name.rfind('/') + 1);
        if (!name.starts_with(begin) || !name.ends_with(end) ||
            name.size() <= begin.size() + end.size())
            continue;
        const std::string_view number =
            name.substr(begin.size(), name.size() - begin.size() - end.size());
        pid_t process = 0;
        const auto [last, error] =
            std::from_chars(number.data(), number.data() + number.size(), process);
        if (error != std::errc{} || last != number.data() + number.size() || process <= 0) continue;
        if (::kill(process, 0) != 0 && errno == ESRCH) parts.push_back(entry.path());
    }
    std::sort(parts.begin(), parts.end());
    return parts;
}

void warn_of_left_parts(const fs::path& target) {
    for (const fs::path& part : left_parts(target))
        log_warning(fmt::format(
            "{}: a run that was killed left this part of {}; rename it to use it, or delete it",
            part.string(), target.filename().string()));
}

void remove_left_parts(const fs::path& target) {
    for (const fs::path& part : left_parts(target)) {
        std::error_code error;
        if (fs::remove_all(part, error) > 0 && !error)
            log_info(fmt::format("note         removed {}, which a run that was killed left",
                                 part.string()));
    }
}

void write_text_file(const fs::path& path, const std::string& text) {
    PendingFile file(path);
    std::ofstream out(file.path(), std::ios::binary);
    out << text;
    out.close();
    if (!out) fail("{}: cannot be written (is the disk full?)", path.string());
    file.commit();
}

}  // namespace livetet
