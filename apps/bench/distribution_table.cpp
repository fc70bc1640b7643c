#include "apps/bench/distribution_table.hpp"

#include <fmt/format.h>

namespace livetet {

std::string distribution_heads(const std::string& unit) {
    return fmt::format("{:<44} {:>8} {:>8} {:>8} {:>8}\n", unit, "median", "95 %", "99 %", "worst");
}

std::string distribution_row(const std::string& name, const Distribution& values) {
    return fmt::format("{:<44} {:>8.2f} {:>8.2f} {:>8.2f} {:>8.2f}\n", name, values.median,
                       values.p95, values.p99, values.worst);
}

nlohmann::json json_of(const Distribution& values) {
    return {{"median", values.median},
            {"p95", values.p95},
            {"p99", values.p99},
            {"worst", values.worst},
            {"count", values.count}};
}

}  // namespace livetet
