#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace livetet {

/// `livetet bench scaling`.
struct ScalingArguments {
    std::vector<int> ranks{
        1, 2, 4};  ///< strong scaling; those beyond the machine's cores for iterations alone
    double unknowns = 3e6;
    int refine = 2;  ///< levels by cutting tets into eight
    std::string launcher =
        "mpirun --oversubscribe -n {}";  ///< in front of the program, {} the number of ranks
    std::vector<std::string> others{"gamg", "boomeramg"};
    std::filesystem::path folder;  ///< where meshes, scenes and results are kept; empty: nowhere
    std::filesystem::path json, figure;
};

/// A pressed beam, corotated and static, from nothing to equilibrium at 1e-8, on one rank, two,
/// more, and at a fixed size a rank; the same by other preconditioners; seconds by phase, memory,
/// messages; and from these what 10^3 to 10^5 ranks would take. 0 where every target holds, else 1.
/// Starts `livetet solve` by the launcher: not under mpirun itself.
int bench_scaling(const ScalingArguments& arguments);

}  // namespace livetet
