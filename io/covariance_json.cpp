#include "io/covariance_json.hpp"

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"

namespace livetet {

namespace {

using nlohmann::json;

double mm_or_rad(int i) { return i < 3 ? 1e3 : 1; }

}  // namespace

template <int n>
json covariance_to_json(const Eigen::Matrix<double, n, n>& covariance) {
    json rows = json::array();
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) rows.push_back(mm_or_rad(i) * mm_or_rad(k) * covariance(i, k));
    return rows;
}

template <int n>
Eigen::Matrix<double, n, n> covariance_from_json(const json& rows, const std::string& where) {
    if (!rows.is_array())
        fail("{}: is of the type {}, expected {} numbers by rows", where, rows.type_name(), n * n);
    if (rows.size() != n * n)
        fail("{}: has {} entries, expected {} numbers by rows", where, rows.size(), n * n);
    Eigen::Matrix<double, n, n> covariance;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) {
            const json& entry = rows[static_cast<std::size_t>(n * i + k)];
            if (!entry.is_number())
                fail("{}: entry {} is of the type {}, expected a number", where, n * i + k + 1,
                     entry.type_name());
            covariance(i, k) = entry.get<double>() / (mm_or_rad(i) * mm_or_rad(k));
        }
    check_covariance(covariance, where);
    return covariance;
}

template json covariance_to_json(const Eigen::Matrix<double, 3, 3>&);
template json covariance_to_json(const Eigen::Matrix<double, 6, 6>&);
template Eigen::Matrix<double, 3, 3> covariance_from_json<3>(const json&, const std::string&);
template Eigen::Matrix<double, 6, 6> covariance_from_json<6>(const json&, const std::string&);

}  // namespace livetet
