#pragma once

#include <optional>
#include <string>
#include <vector>

namespace livetet {

/// This program once more, with these arguments, under a virtual X server of its own (xvfb-run). Returns its exit status, or
/// why there was none.
struct VirtualRun {
    int status = 0;
    std::optional<std::string> why_not;
};
VirtualRun run_under_virtual_display(const std::vector<std::string>& arguments);

/// This very command once more, as it was given. Its exit status; where there is none, throws Error that begins with `what`.
int rerun_under_virtual_display(const std::string& what);

}  // namespace livetet
