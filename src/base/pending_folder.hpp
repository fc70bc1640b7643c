#pragma once

#include <filesystem>
#include <optional>

#include "base/temporary_files.hpp"

namespace livetet {

/// Writes a folder atomically: files go to the folder `path` beside the target, and `commit`
/// renames it. Without `commit`, or if a signal ends the program, that folder is removed.
class PendingFolder {
  public:
    /// Throws Error if the target holds files or is one, or if the folder that it goes to does not
    /// exist or is not writable.
    explicit PendingFolder(std::filesystem::path target);
    ~PendingFolder();
    PendingFolder(const PendingFolder&) = delete;
    PendingFolder& operator=(const PendingFolder&) = delete;

    /// An empty folder to write to.
    const std::filesystem::path& path() const { return temporary_; }
    /// Flushes the files to the disk and renames the folder. Throws Error if that fails.
    void commit();

  private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::optional<TemporaryPath> signal_guard_;
    bool committed_ = false;
};

}  // namespace livetet
