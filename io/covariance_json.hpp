#pragma once

#include <Eigen/Core>

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace livetet {

/// Entries by rows of a covariance of three lengths (n = 3), or of three lengths and three angles
/// (n = 6): m and rad in the matrix, mm and rad in JSON.
template <int n>
nlohmann::json covariance_to_json(const Eigen::Matrix<double, n, n>& covariance);

/// Inverse of `covariance_to_json`. Throws Error, beginning with `where` (file and key), if `rows`
/// are not n * n numbers, or as `check_covariance` does.
template <int n>
Eigen::Matrix<double, n, n> covariance_from_json(const nlohmann::json& rows,
                                                 const std::string& where);

}  // namespace livetet
