#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/distribution.hpp"

namespace livetet {

/// Column heads of `distribution_row`, with their unit.
std::string distribution_heads(const std::string& unit);
std::string distribution_row(const std::string& name, const Distribution& values);

/// median, p95, p99, worst and count; the unit belongs in the key of this object.
nlohmann::json json_of(const Distribution& values);

}  // namespace livetet
