#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace livetet {

/// A target that a result's scene has elsewhere than the run had it.
struct MovedTarget {
    std::string name;
    double distance_mm = 0;  ///< of a region: to the nearest of its places
};

/// Compares the places of a recorded run's targets with those that its scene names now: a file of
/// points or a mask may have changed since. Empty if the run has no targets. Throws Error if the
/// result or a file of its scene cannot be read.
std::vector<MovedTarget> moved_targets(const std::filesystem::path& result);

}  // namespace livetet
