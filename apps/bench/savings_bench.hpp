#pragma once

#include <filesystem>

namespace livetet {

struct SavingsArguments {
    std::filesystem::path scene, json, folder;
    int repeats = 5;
};

/// What a scene saves by what it leaves out: as it is, against the same scene with one thing forced
/// on that it does not need, and with all of them; times and memory, runs interleaved. Returns the
/// exit status.
int bench_savings(const SavingsArguments& arguments);

}  // namespace livetet
