#pragma once

#include <filesystem>

namespace livetet {

/// While it lives, a signal that ends the program removes this file or folder first, with all that
/// is in it. Not more than 64 at a time, those that come later stay.
class TemporaryPath {
  public:
    explicit TemporaryPath(const std::filesystem::path& path);
    ~TemporaryPath();
    TemporaryPath(const TemporaryPath&) = delete;
    TemporaryPath& operator=(const TemporaryPath&) = delete;

  private:
    int place_;
};

/// From now on Ctrl-C, SIGTERM, SIGHUP and SIGPIPE remove what is left over before they end the
/// program, wherever nothing else was asked to handle them. To be called once, before any thread.
void remove_temporary_files_at_signals();

}  // namespace livetet
