#pragma once

#include <filesystem>

namespace livetet {

struct ViewBenchArguments {
    double seconds = 6;   ///< of each stretch
    int stretches = 5;    ///< with the window, and as many without
    double rate_Hz = 40;  ///< of the tracker
    double budget_ms = 10;
    int tets = 60000;
    std::filesystem::path json;
};

/// The window beside a run on the phantom, off screen at 1280 x 800, drawing and not drawing by
/// turns: pictures a second, what a picture takes, and frame times with and without. Prints a
/// table; returns 0, or 1 where there are fewer than 25 pictures a second.
int bench_view(const ViewBenchArguments& arguments);

}  // namespace livetet
