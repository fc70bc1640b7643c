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

/// A reader of untrusted bytes. `run` may return or throw livetet::Error; anything else is a
/// defect.
struct Target {
    std::string name;
    std::function<void(ByteView)> run;
    std::function<std::vector<Bytes>()> seeds;  ///< valid inputs, to be changed
};

Bytes bytes_of(const std::filesystem::path& path);

/// The targets of one fuzz program, which defines this function.
std::vector<Target> targets();

}  // namespace livetet::fuzz
