#include "apps/phantom/phantom_shape.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace livetet::phantom {

namespace {

using Eigen::Vector3d;

struct Ellipsoid {
    Vector3d centre, radii;  // metres, from the organ's centre
};

// The lobes, their connection, and the hollow below.
const Ellipsoid right_lobe{{0.0258, 0.0000, -0.0025}, {0.0492, 0.0550, 0.0425}};
const Ellipsoid left_lobe{{-0.042, 0.011, 0.006}, {0.033, 0.034, 0.021}};
const Ellipsoid middle{{-0.014, 0.010, 0.004}, {0.038, 0.038, 0.027}};
const Ellipsoid hollow{{-0.016, -0.010, -0.061}, {0.062, 0.055, 0.044}};
constexpr double blend = 0.012;  // m, width of the blend between them

// f (f - 1) / |grad f| with f = |x / r|: zero on the ellipsoid, and a distance to first order
// beside it.
double distance_to(const Ellipsoid& e, const Vector3d& place) {
    const Vector3d x = (place - e.centre).cwiseQuotient(e.radii);
    const double f = x.norm(), slope = x.cwiseQuotient(e.radii).norm();
    return slope > 0 ? f * (f - 1) / slope : -e.radii.minCoeff();
}

// Smooth minimum of two distances (polynomial).
double smooth_union(double a, double b, double k) {
    const double h = std::clamp(0.5 + 0.5 * (b - a) / k, 0.0, 1.0);
    return b + h * (a - b) - k * h * (1 - h);
}

// A tube that narrows towards one end.
struct Tube {
    Vector3d from, to;  // metres, from the organ's centre
    double from_radius, to_radius;
};

double distance_to(const Tube& tube, const Vector3d& place) {
    const Vector3d axis = tube.to - tube.from;
    const double along = std::clamp((place - tube.from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    return (place - tube.from - along * axis).norm() -
           (tube.from_radius + along * (tube.to_radius - tube.from_radius));
}

// A portal tree that enters at the hollow, and three veins that meet high at the back.
const std::array<Tube, 12> vessels{{
    {{-0.012, 0.000, -0.016}, {-0.006, 0.004, 0.000}, 0.0060, 0.0055},
    {{-0.006, 0.004, 0.000}, {0.020, 0.000, -0.004}, 0.0050, 0.0042},
    {{-0.006, 0.004, 0.000}, {-0.034, 0.012, 0.006}, 0.0042, 0.0030},
    {{-0.034, 0.012, 0.006}, {-0.058, 0.020, 0.010}, 0.0028, 0.0016},
    {{0.020, 0.000, -0.004}, {0.046, 0.024, 0.004}, 0.0038, 0.0022},
    {{0.020, 0.000, -0.004}, {0.050, -0.022, -0.012}, 0.0038, 0.0022},
    {{0.036, 0.013, 0.000}, {0.038, 0.024, 0.022}, 0.0026, 0.0014},
    {{0.036, -0.012, -0.008}, {0.060, -0.012, 0.012}, 0.0024, 0.0014},
    {{-0.002, -0.026, 0.020}, {0.032, -0.018, 0.016}, 0.0050, 0.0034},
    {{0.032, -0.018, 0.016}, {0.056, 0.006, 0.010}, 0.0032, 0.0018},
    {{-0.002, -0.026, 0.020}, {0.008, 0.018, 0.018}, 0.0042, 0.0020},
    {{-0.002, -0.026, 0.020}, {-0.042, 0.000, 0.016}, 0.0040, 0.0018},
}};

// The n-th number of van der Corput's sequence in a base, for Halton points.
double van_der_corput(int n, int base) {
    double value = 0, digit = 1.0 / base;
    for (; n > 0; n /= base, digit /= base) value += digit * (n % base);
    return value;
}

// Along the press, m; then beside it: depth, and offset to each side.
constexpr std::array depths{0.007, 0.011, 0.015, 0.019, 0.024, 0.030, 0.037, 0.045};
constexpr std::array<std::array<double, 3>, 10> beside{{{0.009, 0.012, 10},
                                                        {0.013, 0.010, 95},
                                                        {0.017, 0.014, 200},
                                                        {0.012, 0.011, 290},
                                                        {0.022, 0.012, 45},
                                                        {0.026, 0.015, 160},
                                                        {0.016, 0.019, 250},
                                                        {0.020, 0.021, 330},
                                                        {0.014, 0.024, 130},
                                                        {0.032, 0.018, 75}}};

}  // namespace

Vector3d organ_centre() { return {0.038, 0.012, -0.025}; }
Vector3d organ_half_extents() { return {0.075, 0.055, 0.040}; }

double organ_distance(const Vector3d& place) {
    const Vector3d x = place - organ_centre();
    const double lobes =
        smooth_union(smooth_union(distance_to(right_lobe, x), distance_to(middle, x), blend),
                     distance_to(left_lobe, x), blend);
    return -smooth_union(-lobes, distance_to(hollow, x), blend);
}

double body_distance(const Vector3d& place) {
    const Vector3d radii(0.088, 0.070, 0.055);
    const Vector3d x = (place - organ_centre()).cwiseQuotient(radii);
    const double size = std::pow(x.array().abs().pow(4).sum(), 0.25);
    return (size - 1) * radii.minCoeff();
}

double vessel_distance(const Vector3d& place) {
    const Vector3d x = place - organ_centre();
    double least = 1;
    for (const Tube& tube : vessels) least = std::min(least, distance_to(tube, x));
    return least;
}

Vector3d organ_normal(const Vector3d& place) {
    constexpr double h = 1e-5;
    Vector3d slope;
    for (int c = 0; c < 3; ++c)
        slope[c] = organ_distance(place + h * Vector3d::Unit(c)) -
                   organ_distance(place - h * Vector3d::Unit(c));
    return slope.normalized();
}

Vector3d organ_exit(const Vector3d& inside, const Vector3d& direction) {
    const Vector3d ray = direction.normalized();
    double in = 0, out = 0.001;
    while (organ_distance(inside + out * ray) < 0) in = out, out += 0.001;
    for (int halvings = 0; halvings < 40; ++halvings) {
        const double middle_way = 0.5 * (in + out);
        (organ_distance(inside + middle_way * ray) < 0 ? in : out) = middle_way;
    }
    return inside + in * ray;
}

bool is_held(const Vector3d& place) {
    constexpr double layer = 0.004, highest = 0.002;  // m; the second from the organ's centre
    return std::abs(organ_distance(place)) <= layer && place.z() - organ_centre().z() < highest &&
           organ_normal(place).z() < -0.4;
}

Vector3d sensor_place() {
    return organ_exit(organ_centre() + Vector3d(0.030, 0.004, 0), Vector3d(0.05, 0.08, 1));
}

Vector3d reference_place() {
    return organ_exit(organ_centre() + Vector3d(0.034, -0.020, 0), Vector3d(0, 0, -1));
}

std::vector<NamedPoint> fiducials() {
    const std::array<Vector3d, 5> directions{{{-0.80, 0.35, 0.30},
                                              {0.15, 1.00, 0.25},
                                              {0.95, 0.20, -0.15},
                                              {0.30, -0.60, 0.75},
                                              {-0.35, -0.90, -0.20}}};
    std::vector<NamedPoint> points;
    for (std::size_t i = 0; i < directions.size(); ++i) {
        // The distance function is linear along a ray from the centre, so one division finds the
        // surface.
        const Vector3d ray = 0.1 * directions[i].normalized();
        const double middle_value = body_distance(organ_centre());
        const double reach = -middle_value / (body_distance(organ_centre() + ray) - middle_value);
        points.push_back({fmt::format("F{}", i + 1), organ_centre() + reach * ray});
    }
    return points;
}

std::vector<NamedPoint> targets() {
    constexpr double inside = -0.005, apart = 0.016;  // metres
    constexpr std::size_t count = 32;
    std::vector<NamedPoint> points;
    const auto add = [&](const Vector3d& place) {
        if (organ_distance(place) <= inside)
            points.push_back({fmt::format("T{:02}", points.size() + 1), place});
    };
    const Vector3d sensor = sensor_place(), inwards = -organ_normal(sensor);
    for (const double depth : depths) add(sensor + depth * inwards);
    const Vector3d side = inwards.cross(Vector3d::UnitY()).normalized(),
                   other = inwards.cross(side);
    for (const auto& [depth, distance, degrees] : beside) {
        const double angle = degrees * std::numbers::pi / 180;
        add(sensor + depth * inwards +
            distance * (std::cos(angle) * side + std::sin(angle) * other));
    }
    for (int n = 1; points.size() < count; ++n) {
        const Vector3d u(van_der_corput(n, 2), van_der_corput(n, 3), van_der_corput(n, 5));
        const Vector3d place =
            organ_centre() + organ_half_extents().cwiseProduct(2 * u - Vector3d::Ones());
        const bool crowded = std::any_of(points.begin(), points.end(), [&](const NamedPoint& p) {
            return (p.position - place).norm() < apart;
        });
        if (!crowded) add(place);
    }
    return points;
}

}  // namespace livetet::phantom
