#include "apps/bench/accuracy_population.hpp"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <system_error>
#include <thread>

#include "apps/bench/realtime_cases.hpp"
#include "base/child_process.hpp"
#include "base/counted.hpp"
#include "base/packing.hpp"
#include "base/parallel_jobs.hpp"
#include "solvers/parallel/petsc_session.hpp"

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

/// How far each body's runs are, in memory that child processes share.
class SharedFractions {
  public:
    explicit SharedFractions(int count) : count_(static_cast<std::size_t>(count)) {
        void* at = ::mmap(nullptr, count_ * sizeof(Fraction), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        if (at == MAP_FAILED)
            throw std::system_error(errno, std::generic_category(), "memory for the progress");
        fractions_ = new (at) Fraction[count_]{};
    }
    ~SharedFractions() { ::munmap(fractions_, count_ * sizeof(Fraction)); }
    SharedFractions(const SharedFractions&) = delete;
    SharedFractions& operator=(const SharedFractions&) = delete;

    void set(int k, double fraction) { fractions_[k] = fraction; }
    double mean() const {
        return std::accumulate(fractions_, fractions_ + count_, 0.0) / static_cast<double>(count_);
    }

  private:
    using Fraction = std::atomic<double>;
    static_assert(Fraction::is_always_lock_free, "a lock would not be shared");
    std::size_t count_;
    Fraction* fractions_;
};

BodyRuns press_in_child(const Population& population, int body, SharedFractions& fractions) {
    constexpr double no_limit_s = 1e9;
    const auto work = [&](int answer) {
        PetscSession session("livetet", {});
        const BodyRuns runs = press_body(
            population, body, [&](double done, std::string_view) { fractions.set(body, done); });
        Packer packer;
        packer.add(runs.motion_mm);
        packer.add(runs.errors);
        const std::vector<char> bytes = packer.take_bytes();
        return write_all(answer, bytes.data(), bytes.size()) ? 0 : 1;
    };
    const ChildResult child = run_in_child(work, no_limit_s);
    const std::string who = fmt::format("bench accuracy: body {}", body + 1);
    if (child.end != ChildResult::End::returned)
        fail("{} {}", who, describe_end(child, no_limit_s));
    fractions.set(body, 1);
    Unpacker unpacker(child.result, who);
    auto motion_mm = unpacker.take<double>();
    return {std::move(motion_mm), unpacker.take<AccuracyErrors>()};
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

BodyRuns press_body(const Population& population, int body, const ProgressCallback& progress) {
    // 1. the body, its truth, and the model that knows its spreads alone
    const auto [true_body, share] = draw_bodies(population.bodies)[static_cast<std::size_t>(body)];
    const auto scaled = [share = share](int tets) {
        return static_cast<int>(std::lround(share * tets));
    };
    const PhantomImages images = make_phantom_images(0.0015, static_cast<std::uint64_t>(body + 1));
    progress(0, "truth");
    const PressedOrgan organ =
        press_organ(images, scaled(population.truth_tets), population.depths, {}, true_body);
    Scene scene = accuracy_scene();
    scene.materials[0].poisson.spread = stated_poisson_spread;
    AccuracyModel model(scene, mesh_phantom(images, {"", scaled(population.tets), 0, 0, 0}, {}),
                        organ);

    // 2. its runs
    BodyRuns runs{true_motion_mm(organ.truth), {}};
    const std::size_t all = population.trackers.size() * population.sensors * population.seeds *
                            population.depths.size();
    for (const TrackerKind& tracker : population.trackers)
        for (int sensors = 1; sensors <= population.sensors; ++sensors) {
            AccuracyCase c{tracker.position_rms_mm, tracker.rotation_rms_deg, sensors};
            for (int run = 0; run < population.seeds; ++run) {
                progress(static_cast<double>(runs.errors.size()) / static_cast<double>(all),
                         fmt::format("{} mm, {} of {} sensors", tracker.position_rms_mm, sensors,
                                     population.sensors));
                c.seed = static_cast<std::uint64_t>(body * population.seeds + run + 1);
                const std::vector<AccuracyErrors> errors = model.run(c);
                runs.errors.insert(runs.errors.end(), errors.begin(), errors.end());
            }
        }
    return runs;
}

std::vector<AccuracyTable> tables_of(const Population& population,
                                     std::span<const BodyRuns> bodies) {
    const std::size_t depths = population.depths.size();
    std::vector<AccuracyTable> tables;
    for (const TrackerKind& tracker : population.trackers) {
        AccuracyTable& table = tables.emplace_back(AccuracyTable{tracker, {}, {}, {}});
        for (const double depth : population.depths) table.depths_mm.push_back(1e3 * depth);
        table.motion_mm.assign(depths, 0);
        table.by_sensors.resize(static_cast<std::size_t>(population.sensors));
    }
    for (const BodyRuns& body : bodies) {
        auto next = body.errors.begin();
        for (AccuracyTable& table : tables) {
            for (std::size_t d = 0; d < depths; ++d)  // RMS over the bodies
                table.motion_mm[d] =
                    std::hypot(table.motion_mm[d],
                               body.motion_mm[d] / std::sqrt(static_cast<double>(bodies.size())));
            for (AccuracySeries& cell : table.by_sensors)
                for (int run = 0; run < population.seeds; ++run) {
                    const auto end = next + static_cast<std::ptrdiff_t>(depths);
                    cell.runs.emplace_back(next, end);
                    next = end;
                }
        }
    }
    return tables;
}

std::vector<AccuracyTable> press_population(const Population& population,
                                            const ProgressCallback& progress) {
    SharedFractions fractions(population.bodies);
    const std::jthread watch([&](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
            progress(fractions.mean(), counted(population.bodies, "body", "bodies"));
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
    });
    std::vector<BodyRuns> bodies(static_cast<std::size_t>(population.bodies));
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const JobsEnd end = run_jobs(bodies.size(), cores, AfterError::stop, [&](std::size_t b) {
        bodies[b] = press_in_child(population, static_cast<int>(b), fractions);
    });
    if (end.first_error) std::rethrow_exception(end.first_error);
    return tables_of(population, bodies);
}

}  // namespace livetet
