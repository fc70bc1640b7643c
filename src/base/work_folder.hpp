#pragma once

#include <stdlib.h>  // mkdtemp

#include <cerrno>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "base/error.hpp"
#include "base/temporary_files.hpp"

namespace livetet {

/// Folder for intermediate files: the user's, or a temporary one removed by the destructor.
class WorkFolder {
  public:
    explicit WorkFolder(const std::filesystem::path& requested = {})
        : path_(requested), kept_(!requested.empty()) {
        if (!kept_) {
            std::string name = (std::filesystem::temp_directory_path() / "livetet_XXXXXX").string();
            if (!::mkdtemp(name.data()))
                fail("{}: cannot be made: {}", name, std::generic_category().message(errno));
            path_ = name;
            signal_guard_.emplace(path_);
        }
        std::error_code error;
        std::filesystem::create_directories(path_, error);
        if (error) fail("{}: cannot be made: {}", path_.string(), error.message());
        path_ = std::filesystem::absolute(path_);
    }
    ~WorkFolder() {
        std::error_code ignored;
        if (!kept_) std::filesystem::remove_all(path_, ignored);
    }
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
    bool kept_;
    std::optional<TemporaryPath> signal_guard_;
};

}  // namespace livetet
