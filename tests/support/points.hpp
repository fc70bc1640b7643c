#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace livetet::test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

inline constexpr double degree = std::numbers::pi / 180;  ///< rad

struct Truth {
    double scale;
    Matrix3d rotation;
    Vector3d translation;
    Vector3d operator*(const Vector3d& p) const { return scale * (rotation * p) + translation; }
};

class Random {
  public:
    explicit Random(unsigned seed) : engine_(seed) {}
    Vector3d vector(double size) {
        return {size * unit_(engine_), size * unit_(engine_), size * unit_(engine_)};
    }
    Vector3d gaussian(double sigma) {
        return {sigma * normal_(engine_), sigma * normal_(engine_), sigma * normal_(engine_)};
    }
    Matrix3d rotation() {
        return Eigen::Quaterniond(normal_(engine_), normal_(engine_), normal_(engine_),
                                  normal_(engine_))
            .normalized()
            .toRotationMatrix();
    }
    Points points(std::size_t count, double size) {
        Points points;
        for (std::size_t i = 0; i < count; ++i) points.push_back(vector(size));
        return points;
    }

  private:
    std::mt19937_64 engine_;
    std::uniform_real_distribution<double> unit_{-1, 1};
    std::normal_distribution<double> normal_;
};

inline Points mapped(const auto& transform, const Points& points) {
    Points result;
    for (const Vector3d& p : points) result.push_back(transform * p);
    return result;
}

inline double rms(const std::vector<double>& values) {
    return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                     static_cast<double>(values.size()));
}

inline std::string message_of(const auto& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace livetet::test
