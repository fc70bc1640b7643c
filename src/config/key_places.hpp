#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <string_view>
#include <utility>

namespace livetet {

/// Where the keys of a YAML file stand: for messages about keys that do not go together, which are
/// compared after all of the file was read.
class KeyPlaces {
  public:
    /// Knows the file alone.
    explicit KeyPlaces(std::string file) : file_(std::move(file)) {}
    /// `text`: of the file, valid YAML.
    KeyPlaces(std::string file, const std::string& text);

    const std::string& file() const { return file_; }
    /// "liver.yaml:12" for "track.sensors[0].patch_spread_mm". The place of the table around it if
    /// the key is not given, and the file if no line is known.
    std::string operator()(std::string_view key) const;

  private:
    std::string file_;
    YAML::Node root_;
};

}  // namespace livetet
