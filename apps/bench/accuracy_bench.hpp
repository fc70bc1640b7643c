#pragma once

#include <filesystem>

namespace livetet {

/// `livetet bench accuracy`.
struct AccuracyArguments {
    int seeds = 100;
    int tets = 6000;         ///< of the model
    int truth_tets = 14000;  ///< of the truth, P2
    std::filesystem::path json, csv, figure;
};

/// Error at targets inside the pressed phantom, rigid-only and deforming: by the tracker's noise,
/// the depth of the press and the number of sensors, and what limits it. 0 where deforming is
/// better in every cell, else 1.
int bench_accuracy(const AccuracyArguments& arguments);

}  // namespace livetet
