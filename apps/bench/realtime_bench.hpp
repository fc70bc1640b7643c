#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace livetet {

/// `livetet bench realtime`.
struct RealtimeArguments {
    std::vector<std::string> sizes{"P60", "V68", "beamA", "beamB"};
    int frames = 1000;  ///< timed, of each phantom case
    int threads = 0;    ///< as solver.threads
    std::filesystem::path json, figure;
};

/// Frame rates and errors of the live solver on the phantom and on a beam; 0 where all targets
/// held, else 1.
int bench_realtime(const RealtimeArguments& arguments);

}  // namespace livetet
