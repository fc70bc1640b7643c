#pragma once

#include <filesystem>
#include <string>

namespace livetet {

struct StabilityArguments {
    int cells = 4;  ///< along the height of the box
    int noise_frames = 1000000;
    double budget_ms = 10;
    std::string only, column;  ///< in the names of the cases and of the columns that are tried
    std::filesystem::path csv, json, figure;
};

/// Every stability case in every strain model and scheme, as `solve` and as `track` step them:
/// matrix, files, picture. Returns the exit status: 1 where a cell fails that is not a known limit.
int bench_stability(const StabilityArguments& arguments);

}  // namespace livetet
