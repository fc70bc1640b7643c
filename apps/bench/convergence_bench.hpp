#pragma once

#include <filesystem>

namespace livetet {

struct ConvergenceArguments {
    double least_nodes = 1050, most_nodes = 1.1e6;  ///< of the meshes of rising size
    double nodes = 1e4;  ///< of the mesh that all else is varied on
    std::filesystem::path csv, json, figure, folder;
};

/// Iterations and time of one linear solve to 1e-8 of a held and pressed beam, by each preconditioner, against mesh size,
/// Poisson's ratio, contrast, anisotropy, levels and smoothing steps. Returns the exit status: 1 where multigrid's
/// iterations grow by more than a fifth from 10^4 nodes to the most.
int bench_convergence(const ConvergenceArguments& arguments);

}  // namespace livetet
