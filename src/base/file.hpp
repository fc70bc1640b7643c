#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/temporary_files.hpp"

namespace livetet {

/// The whole text of a file. Throws Error where it cannot be read.
std::string read_text_file(const std::filesystem::path& path);

/// 16 hexadecimal digits that tell contents apart, FNV-1a of 64 bits; against mistakes, not against
/// malice.
std::string digest(std::string_view contents);

/// Whether both names are those of one file, there or not; an empty name is that of none.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// A file under way: written beside its place and moved there by `commit`, so that a good file is
/// never replaced by a half-written one. Destroyed without `commit`, or ended by a signal (see
/// TemporaryPath), it leaves nothing behind.
class PendingFile {
  public:
    /// Throws Error where the folder does not exist or cannot be written to.
    explicit PendingFile(std::filesystem::path target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    /// Where to write: same folder, same ending as the target.
    const std::filesystem::path& path() const { return temporary_; }
    void commit();

  private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::optional<TemporaryPath> signal_guard_;
    bool committed_ = false;
};

/// Writes a text whole or not at all (see PendingFile).
void write_text_file(const std::filesystem::path& path, const std::string& text);

}  // namespace livetet
