#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/temporary_files.hpp"

namespace livetet {

/// Throws Error if there is no regular file at `path`; for a folder it says that.
void check_is_file(const std::filesystem::path& path);

/// The contents of a file. Throws Error if it cannot be read.
std::string read_text_file(const std::filesystem::path& path);

/// 64-bit FNV-1a hash as 16 hexadecimal digits. Detects changed contents; not cryptographic.
std::string digest(std::string_view contents);

/// Whether both paths name the same file, existing or not. An empty path names no file.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Writes a file atomically: the data goes to `path` beside the target, and `commit` moves it
/// there, so a good file is never replaced by a partial one. Without `commit`, or if a signal ends
/// the program (see TemporaryPath), the temporary file is removed.
class PendingFile {
  public:
    /// Throws Error if the folder does not exist or is not writable.
    explicit PendingFile(std::filesystem::path target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    /// The file to write: in the target's folder, with the target's extension.
    const std::filesystem::path& path() const { return temporary_; }
    /// Flushes the file to the disk and renames it to the target. Throws Error if that fails.
    void commit();

  private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::optional<TemporaryPath> signal_guard_;
    bool committed_ = false;
};

/// Throws Error if the file cannot be written: before the work whose result it is to hold.
void expect_writable(const std::filesystem::path& target);

/// Part files of `target` that runs left which did not end by themselves: no process has their
/// number any more.
std::vector<std::filesystem::path> left_parts(const std::filesystem::path& target);

/// Warns of each of them: of a file that grows, whose parts can be used.
void warn_of_left_parts(const std::filesystem::path& target);

/// Removes each of them, with a note: of a file that is written at the end of a run.
void remove_left_parts(const std::filesystem::path& target);

/// Writes a text file atomically (see PendingFile). Throws Error if that fails.
void write_text_file(const std::filesystem::path& path, const std::string& text);

}  // namespace livetet
