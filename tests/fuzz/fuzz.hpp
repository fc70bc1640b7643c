#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace livetet::fuzz {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// A reader of hostile bytes. `run` may return, or throw livetet::Error; all else is a fault of the
/// reader.
struct Target {
    std::string name;
    std::function<void(ByteView)> run;
    std::function<std::vector<Bytes>()> seeds;  ///< good inputs, to be changed
};

Bytes bytes_of(const std::filesystem::path& path);

/// Those of one program; defined beside them.
std::vector<Target> targets();

}  // namespace livetet::fuzz
