#pragma once

#include <filesystem>
#include <string>

namespace livetet {

struct ConvergenceArguments {
    double least_nodes = 1050, most_nodes = 1.1e6;  ///< of the meshes of rising size
    double nodes = 1e4;                             ///< of the mesh that all else is varied on
    std::string
        only;  ///< of what is varied and the preconditioner: what has this in "nodes, multigrid"
    std::filesystem::path csv, json, figure, folder;
};

/// Iterations and time of one linear solve to 1e-8 of a held and pressed beam, by each
/// preconditioner, against mesh size, Poisson's ratio, contrast, anisotropy, levels and smoothing
/// steps. Returns the exit status: 1 where multigrid's iterations grow by more than a fifth from
/// 10^4 nodes to the most. Throws Error.
int bench_convergence(const ConvergenceArguments& arguments);

}  // namespace livetet
