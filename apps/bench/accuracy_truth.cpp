#include "apps/bench/accuracy_truth.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "apps/bench/realtime_cases.hpp"
#include "apps/phantom/phantom.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "geometry/umeyama.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

constexpr double riding_radius = 0.006;  // of a model's patch, m

struct SensorRing {
    double tilt_deg;  ///< angle from the pressed position, seen from `depth_of_centre` below it
    int places;
    int stride;  ///< step between selected positions, so that the first few are spread out
};
constexpr double depth_of_centre = 0.04;  // m
constexpr SensorRing rings[] = {{40, 5, 2}, {75, 10, 3}};

/// Two unit vectors orthogonal to a third.
std::pair<Vector3, Vector3> across(const Vector3& axis) {
    const Vector3 side = axis.cross(Vector3::UnitY()).normalized();
    return {side, axis.cross(side)};
}

std::vector<Vector3> sensor_places() {
    constexpr double degree = std::numbers::pi / 180;
    std::vector<Vector3> places{phantom::sensor_place()};
    const Vector3 outwards = phantom::organ_normal(places.front()),
                  centre = places.front() - depth_of_centre * outwards;
    const auto [side, other] = across(outwards);
    for (const SensorRing& ring : rings)
        for (int i = 0; i < ring.places; ++i) {
            const double turn =
                2 * std::numbers::pi * (i * ring.stride % ring.places) / ring.places;
            const Vector3 sideways = std::cos(turn) * side + std::sin(turn) * other;
            places.push_back(
                phantom::organ_exit(centre, std::cos(ring.tilt_deg * degree) * outwards +
                                                std::sin(ring.tilt_deg * degree) * sideways));
        }
    return places;
}

/// A point on the surface and six around it, 4 mm away.
std::vector<Vector3> places_around(const Vector3& place) {
    constexpr double radius = 0.004, below = 0.01;  // m
    const Vector3 outwards = phantom::organ_normal(place);
    const auto [side, other] = across(outwards);
    std::vector<Vector3> around{place};
    for (int i = 0; i < 6; ++i) {
        const double turn = std::numbers::pi / 3 * i;
        const Vector3 aside = radius * (std::cos(turn) * side + std::sin(turn) * other);
        around.push_back(phantom::organ_exit(place + aside - below * outwards, outwards));
    }
    return around;
}

}  // namespace

PressedOrgan press_organ(const PhantomImages& images, int tets, std::vector<double> depths,
                         const ProgressCallback& progress, const TrueBody& body) {
    PressedOrgan organ;
    organ.truth = true_motion(phantom_tracker({}), {});
    organ.truth.depths = std::move(depths);
    organ.truth.patch_radius = body.patch_radius;

    const std::vector<NamedPoint> targets = phantom::targets();
    std::vector<NamedPoint> points = targets;
    const std::vector<Vector3> places = sensor_places();
    for (const Vector3& place : places)
        for (const Vector3& p : places_around(place))
            points.push_back({fmt::format("S{}", points.size()), p});
    const PatchGrading at_presser{{{places.front(), body.patch_radius}}};
    solve_truth(
        with_quadratic_level(mesh_phantom(images, {"truth", tets, 0, 0, 0}, progress, at_presser)),
        points, organ.truth, progress, rounded_press(body.patch_radius, body.poisson));

    auto next = organ.truth.targets.begin() + static_cast<std::ptrdiff_t>(targets.size());
    const auto first = next;
    for (const Vector3& place : places) {
        const bool pressed = organ.sensors.empty();
        TrueSensor sensor{{phantom_tracker({}).image_from_sensor_at_rest.rotation, place},
                          pressed ? flat_radius_of(rounded_press(TrueBody{}.patch_radius),
                                                   TrueBody{}.patch_radius)
                                  : riding_radius,
                          pressed ? DriveMotion::translation : DriveMotion::rigid,
                          {next, next + 7}};
        next += 7;
        organ.sensors.push_back(std::move(sensor));
    }
    organ.truth.targets.erase(first, organ.truth.targets.end());
    return organ;
}

RigidTransform<ImageFrame, Sensor> sensor_at(const PressedOrgan& organ, const TrueSensor& sensor,
                                             double depth) {
    std::vector<Vector3> rest, now;
    for (const TruthTarget& p : sensor.around) {
        rest.push_back(p.position);
        now.push_back(p.position + displacement_of(organ.truth, p, depth));
    }
    return rigid_part(register_points<ImageFrame, ImageFrame>(rest, now).to_from_from) *
           sensor.at_rest;
}

}  // namespace livetet
