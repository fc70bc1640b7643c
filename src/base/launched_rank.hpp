#pragma once

#include <cstdlib>
#include <optional>

namespace livetet {

/// The rank that the launcher of Open MPI or MPICH has given this process, known before MPI is
/// initialised; none without such a launcher.
inline std::optional<int> launched_rank() {
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK"})
        if (const char* value = std::getenv(name)) return std::atoi(value);
    return std::nullopt;
}

}  // namespace livetet
