#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/scene/body_factory.hpp"

namespace livetet {

/// Cost of a part of a run: bytes on all ranks, seconds of the slowest; none if it was left out.
struct ProfileRow {
    std::string part;
    PhaseCost cost;
    bool is_built = false;
    std::string why;  ///< reason, if it was left out
};

/// The parts of a run: set-up and steps. Collective.
std::vector<ProfileRow> solve_profile(MPI_Comm comm, const Scene& scene, const SceneBody& body,
                                      double mesh_s, const PhaseCost& output);

/// Formats the rows as a table.
std::string profile_table(std::span<const ProfileRow> rows);
nlohmann::json json_of(std::span<const ProfileRow> rows);

}  // namespace livetet
