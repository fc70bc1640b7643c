#include "apps/verification/suite.hpp"

#include <cmath>

namespace livetet::verification {

double Outcome::observed_order() const {
    if (runs.size() < 2) return 0;
    const Run &coarse = runs[runs.size() - 2], &fine = runs.back();
    if (!(coarse.h > fine.h) || !(fine.error > 0)) return 0;
    return std::log(coarse.error / fine.error) / std::log(coarse.h / fine.h);
}

bool Outcome::passed() const {
    if (tolerance == 0) return true;
    if (!std::isfinite(last().error) || last().error > tolerance) return false;
    return expected_order == 0 || std::abs(observed_order() - expected_order) <= order_tolerance;
}

std::span<const Case> cases() {
    static const std::vector<Case> all = [] {
        std::vector<Case> list;
        for (auto&& part : {homogeneous_cases(), incompressible_cases(), structural_cases(),
                            dynamic_cases(), recovery_cases(), material_cases(), press_cases()})
            list.insert(list.end(), part.begin(), part.end());
        return list;
    }();
    return all;
}

}  // namespace livetet::verification
