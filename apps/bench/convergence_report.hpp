#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/bench/convergence_solves.hpp"

namespace livetet {

void print_convergence(const std::vector<ConvergencePoint>& points);
std::string convergence_csv(const std::vector<ConvergencePoint>& points);
nlohmann::json convergence_json(const std::vector<ConvergencePoint>& points);
#ifdef LIVETET_IMAGES
/// Iterations and seconds of each method against nodes, to a PNG.
void draw_convergence(const std::filesystem::path& path,
                      const std::vector<ConvergencePoint>& points);
#endif

/// Prints how multigrid's iterations grow from 10^4 nodes on. True if by at most a fifth.
bool judge_growth(const std::vector<ConvergencePoint>& points);

/// Prints how good `automatic` is on bodies. True if it takes at most 40 iterations on the organ
/// with levels, and on one level at most twice the time of the quickest other; times are judged
/// from 5000 nodes on.
bool judge_bodies(const std::vector<ConvergencePoint>& points);

}  // namespace livetet
