#include "apps/bench/accuracy_population.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "apps/bench/realtime_cases.hpp"

namespace livetet {

namespace {

/// The value that a standard normal variable stays below with probability p.
double normal_quantile(double p) {
    double low = -8, high = 8;
    while (high - low > 1e-12) {
        const double middle = (low + high) / 2;
        (std::erfc(-middle / std::numbers::sqrt2) / 2 < p ? low : high) = middle;
    }
    return low;
}

/// Medians of `count` equally likely parts of the unit interval, shuffled.
std::vector<double> shuffled_parts(int count, std::mt19937_64& engine) {
    std::vector<double> parts;
    for (int i = 0; i < count; ++i) parts.push_back((i + 0.5) / count);
    for (std::size_t i = parts.size(); i > 1; --i)  // std::shuffle differs between libraries
        std::swap(parts[i - 1], parts[engine() % i]);
    return parts;
}

/// One body's runs, added to the tables.
void add_runs(std::vector<AccuracyTable>& tables, AccuracyModel& model, const PopulationSize& size,
              int body, const ProgressCallback& progress) {
    const auto cells = static_cast<double>(tables.size()) * size.sensors;
    int done = 0;
    for (AccuracyTable& table : tables)
        for (int sensors = 1; sensors <= size.sensors; ++sensors) {
            AccuracyCase c{table.tracker.position_rms_mm, table.tracker.rotation_rms_deg, sensors};
            progress(done++ / cells, fmt::format("{} mm, {} of {} sensors", c.position_rms_mm,
                                                 sensors, size.sensors));
            for (int run = 0; run < size.seeds; ++run) {
                c.seed = static_cast<std::uint64_t>(body * size.seeds + run + 1);
                table.by_sensors[static_cast<std::size_t>(sensors - 1)].runs.push_back(
                    model.run(c));
            }
        }
}

/// Adds a body's motion to the RMS over all of them.
void add_motion(std::vector<AccuracyTable>& tables, const std::vector<double>& motion_mm,
                int bodies) {
    for (AccuracyTable& table : tables)
        for (std::size_t d = 0; d < motion_mm.size(); ++d)
            table.motion_mm[d] = std::hypot(table.motion_mm[d], motion_mm[d] / std::sqrt(bodies));
}

}  // namespace

std::vector<DrawnBody> draw_bodies(int count) {
    std::mt19937_64 engine(1);
    const auto poisson = shuffled_parts(count, engine), radius = shuffled_parts(count, engine),
               mesh = shuffled_parts(count, engine);
    std::vector<DrawnBody> bodies;
    for (std::size_t i = 0; i < poisson.size(); ++i) {
        const TrueBody usual;
        bodies.push_back(
            {{usual.poisson + stated_poisson_spread * normal_quantile(poisson[i]),
              usual.patch_radius * (1 + stated_radius_share * normal_quantile(radius[i]))},
             0.8 * std::pow(1.25 / 0.8, mesh[i])});
    }
    return bodies;
}

std::vector<AccuracyTable> press_population(const PopulationSize& size,
                                            std::span<const TrackerKind> trackers,
                                            const std::vector<double>& depths,
                                            const ProgressCallback& progress) {
    std::vector<AccuracyTable> tables;
    for (const TrackerKind& tracker : trackers) {
        AccuracyTable& table = tables.emplace_back(AccuracyTable{tracker, {}, {}, {}});
        for (const double depth : depths) table.depths_mm.push_back(1e3 * depth);
        table.motion_mm.assign(depths.size(), 0);
        table.by_sensors.resize(static_cast<std::size_t>(size.sensors));
    }
    Scene scene = accuracy_scene();
    scene.materials[0].poisson.spread = stated_poisson_spread;
    const std::vector<DrawnBody> bodies = draw_bodies(size.bodies);
    for (int b = 0; b < size.bodies; ++b) {
        const ProgressCallback part = [&](double fraction, std::string_view words) {
            progress((b + fraction) / size.bodies,
                     fmt::format("body {} of {}, {}", b + 1, size.bodies, words));
        };
        const auto& [body, share] = bodies[static_cast<std::size_t>(b)];
        const auto scaled = [&](int tets) { return static_cast<int>(std::lround(share * tets)); };
        const PhantomImages images = make_phantom_images(0.0015, static_cast<std::uint64_t>(b + 1));
        part(0, "truth");
        const PressedOrgan organ = press_organ(images, scaled(size.truth_tets), depths, {}, body);
        add_motion(tables, true_motion_mm(organ.truth), size.bodies);
        AccuracyModel model(scene, mesh_phantom(images, {"", scaled(size.tets), 0, 0, 0}, {}),
                            organ);
        add_runs(tables, model, size, b, part);
    }
    return tables;
}

}  // namespace livetet
