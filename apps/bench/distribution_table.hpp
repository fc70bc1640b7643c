#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/distribution.hpp"

namespace livetet {

/// The heads of the columns that `distribution_row` fills, after `unit`.
std::string distribution_heads(const std::string& unit);
std::string distribution_row(const std::string& name, const Distribution& values);

/// median, p95, p99, worst and count; the unit belongs into the key that this is kept under.
nlohmann::json json_of(const Distribution& values);

}  // namespace livetet
