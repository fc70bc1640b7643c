#include "apps/phantom/phantom_images.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "apps/phantom/phantom_shape.hpp"

namespace livetet {

namespace {

using Eigen::Vector3d;

constexpr double margin = 0.025;  // margin around the organ, m, for the markers on the container

// Grey values, before shading and noise.
constexpr double air = 0, shell = 520, filling = 170, rod = 60, pad = 300, organ = 400,
                 vessel = 190, marker = 900;
constexpr double noise_deviation = 16;

// Share of a voxel inside a surface at `distance`.
double coverage(double distance, double spacing) {
    return std::clamp(0.5 - distance / spacing, 0.0, 1.0);
}

double mix(double below, double above, double share) { return below + share * (above - below); }

// Smooth variation by a few per cent, as tissue is not uniformly grey.
double texture(const Vector3d& x) {
    return 0.5 * std::sin(410 * x.x() + 130 * x.y()) * std::sin(370 * x.y() - 220 * x.z()) +
           0.5 * std::sin(260 * x.z() + 190 * x.x() + 1) * std::sin(310 * x.x() - 150 * x.y());
}

// Beside the organ in the container: a dark rod along its back, and a pad of softer gel below the
// left lobe.
double rod_distance(const Vector3d& x) {
    return Vector3d(x.x() + 0.022, x.y() + 0.050, 0).norm() - 0.009;
}
double pad_distance(const Vector3d& x) {
    const Vector3d radii(0.034, 0.026, 0.017);
    return (Vector3d(x - Vector3d(-0.040, 0.012, -0.034)).cwiseQuotient(radii).norm() - 1) *
           radii.minCoeff();
}

double marker_distance(const Vector3d& place) {
    static const std::vector<NamedPoint> centres = phantom::fiducials();
    double least = 1;
    for (const NamedPoint& f : centres)
        least = std::min(least, (place - f.position).norm() - phantom::marker_radius);
    return least;
}

double grey_value(const Vector3d& place, double spacing) {
    const Vector3d x = place - phantom::organ_centre();
    const double body = phantom::body_distance(place);
    double grey = mix(air, shell, coverage(body, spacing));
    grey = mix(grey, filling * (1 + 0.05 * texture(x)), coverage(body + 0.0035, spacing));
    grey = mix(grey, pad * (1 + 0.04 * texture(2 * x)), coverage(pad_distance(x), spacing));
    grey = mix(grey, rod, coverage(std::max(rod_distance(x), body + 0.006), spacing));
    // On the container: a ball of fluid, in a casing that is not visible.
    const double ball = marker_distance(place);
    grey = mix(grey, air, coverage(ball - phantom::marker_casing, spacing));
    grey = mix(grey, marker, coverage(ball, spacing));
    const double distance = phantom::organ_distance(place);
    grey = mix(grey, organ * (1 + 0.04 * texture(x)), coverage(distance, spacing));
    return mix(grey, vessel,
               coverage(std::max(phantom::vessel_distance(place), distance + 0.003), spacing));
}

// Shading of a receive coil: up to about a quarter brighter towards front and right.
double bias(const Vector3d& place) {
    const Vector3d x =
        (place - phantom::organ_centre()).cwiseQuotient(phantom::organ_half_extents());
    return std::exp(0.12 * x.y() + 0.08 * x.x() - 0.06 * x.z() * x.z() + 0.05 * x.x() * x.y());
}

template <class T>
Image<T> empty_image(double spacing) {
    Image<T> image;
    for (int c = 0; c < 3; ++c) {
        const double half = phantom::organ_half_extents()[c] + margin;
        image.size[c] = static_cast<int>(std::ceil(2 * half / spacing)) + 1;
        image.ras_from_voxel(c, c) = spacing;
        image.ras_from_voxel(c, 3) =
            phantom::organ_centre()[c] - 0.5 * (image.size[c] - 1) * spacing;
    }
    image.values.resize(static_cast<std::size_t>(image.size[0]) * image.size[1] * image.size[2]);
    return image;
}

// Computes voxels from their centres, in storage order.
template <class T, class ValueAt>
Image<T> sample(double spacing, const ValueAt& value_at) {
    Image<T> image = empty_image<T>(spacing);
    const Eigen::Vector3d corner = image.ras_from_voxel.template block<3, 1>(0, 3);
    for (int k = 0; k < image.size[2]; ++k)
        for (int j = 0; j < image.size[1]; ++j)
            for (int i = 0; i < image.size[0]; ++i)
                image.at(i, j, k) = value_at(corner + spacing * Vector3d(i, j, k));
    return image;
}

}  // namespace

PhantomImages make_phantom_images(double spacing, std::uint64_t seed) {
    PhantomImages images;
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> noise(0, noise_deviation);
    // A scanner shows the magnitude of a complex number with noisy parts: Rician noise.
    images.image = sample<float>(spacing, [&](const Vector3d& place) {
        const double in_phase = bias(place) * grey_value(place, spacing) + noise(engine);
        return static_cast<float>(std::round(std::hypot(in_phase, noise(engine))));
    });
    images.labels = sample<std::int32_t>(
        spacing, [](const Vector3d& place) { return phantom::organ_distance(place) < 0 ? 1 : 0; });
    images.fixed_mask = sample<std::int32_t>(
        spacing, [](const Vector3d& place) { return phantom::is_held(place) ? 1 : 0; });
    return images;
}

}  // namespace livetet
