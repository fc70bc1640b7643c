#pragma once

#include <filesystem>

namespace livetet {

struct WarpBenchArguments {
    int size = 256;  ///< voxels along each axis
    int tets = 60000;
    int repeats = 9;
    std::filesystem::path json;
};

/// The phantom pressed by 15 mm in a volume that it fills as well as it can: what `livetet warp`
/// takes for it, part by part, on one thread and on all, and VTK's probe filter and interpolator
/// for the same in the same run, whose values must be the same. Prints a table; returns the exit
/// status: 0, or 1 where the linear warp takes a second or more on all threads, or VTK's values are
/// others.
int bench_warp(const WarpBenchArguments& arguments);

}  // namespace livetet
