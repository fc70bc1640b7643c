#pragma once

#include <filesystem>

namespace livetet {

/// Marks a file or folder as temporary: while this object lives, a signal that ends the program
/// first removes the path recursively. At most 64 paths are tracked; further ones are ignored. The
/// destructor does not remove anything.
class TemporaryPath {
  public:
    explicit TemporaryPath(const std::filesystem::path& path);
    ~TemporaryPath();
    TemporaryPath(const TemporaryPath&) = delete;
    TemporaryPath& operator=(const TemporaryPath&) = delete;

  private:
    int place_;
};

/// Installs handlers so that SIGINT, SIGTERM, SIGHUP and SIGPIPE remove all temporary paths before
/// they end the program, unless another handler is installed. Call once, before any thread starts.
void remove_temporary_files_at_signals();

}  // namespace livetet
