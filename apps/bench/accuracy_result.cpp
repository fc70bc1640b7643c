#include "apps/bench/accuracy_result.hpp"
#include "base/counted.hpp"

#include <fmt/format.h>

#include <cmath>

namespace livetet {

using nlohmann::json;

namespace {

constexpr std::pair<const char*, double AccuracyErrors::*> errors_by_name[] = {
    {"rigid", &AccuracyErrors::rigid},
    {"deforming", &AccuracyErrors::deforming},
    {"registration", &AccuracyErrors::registration},
    {"deformation", &AccuracyErrors::deformation}};

std::string text_of(const MeanAndSpread& m) {
    return m.sd ? fmt::format("{:.2f} +- {:.2f}", m.mean, *m.sd) : fmt::format("{:.2f}", m.mean);
}

/// How a 95 % radius compares with the errors.
struct Coverage {
    double share;  ///< of the errors within it
    double ratio;  ///< median radius over median error

    bool is_right() const { return share >= 0.92 && share <= 0.98 && ratio <= 2.5; }
};

Coverage coverage_of(const AccuracySeries& series, std::size_t depth) {
    return {over_seeds(series, depth, &AccuracyErrors::covered).mean,
            over_seeds(series, depth, &AccuracyErrors::median_radius).mean /
                over_seeds(series, depth, &AccuracyErrors::median).mean};
}

std::string text_of(const Coverage& c) {
    return fmt::format("{:.1f} % {:.2f}", 100 * c.share, c.ratio);
}

std::vector<std::size_t> first_and_last(std::size_t size) {
    if (size < 2) return std::vector<std::size_t>(size, 0);
    return {0, size - 1};
}

/// Share of the errors that are no larger than stated with each probability, mean over the runs.
std::array<double, 19> mean_within(const AccuracySeries& series, std::size_t depth) {
    std::array<double, 19> mean{};
    for (const auto& run : series.runs)
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += run[depth].within[i] / static_cast<double>(series.runs.size());
    return mean;
}

/// Mean and standard deviation of each error at each depth, mm; how the stated errors compare.
json json_of(const AccuracySeries& series, const std::vector<double>& depths_mm) {
    json list = json::array();
    for (std::size_t d = 0; d < depths_mm.size(); ++d) {
        json at{{"press_mm", depths_mm[d]}};
        for (const auto& [name, error] : errors_by_name) {
            const MeanAndSpread m = over_seeds(series, d, error);
            json& entry = at[fmt::format("{}_mm", name)] = {{"mean", m.mean}};
            if (m.sd) entry["sd"] = *m.sd;
        }
        at["covered"] = over_seeds(series, d, &AccuracyErrors::covered).mean;
        at["within"] = {{"probability", stated_probabilities()}, {"share", mean_within(series, d)}};
        at["median_error_mm"] = over_seeds(series, d, &AccuracyErrors::median).mean;
        at["median_radius_95_mm"] = over_seeds(series, d, &AccuracyErrors::median_radius).mean;
        list.push_back(at);
    }
    return list;
}

}  // namespace

MeanAndSpread over_seeds(const AccuracySeries& series, std::size_t depth,
                         double AccuracyErrors::*error) {
    const auto n = static_cast<double>(series.runs.size());
    MeanAndSpread m;
    for (const auto& run : series.runs) m.mean += run[depth].*error / n;
    if (n < 2) return m;
    double variance = 0;
    for (const auto& run : series.runs)
        variance += std::pow(run[depth].*error - m.mean, 2) / (n - 1);
    m.sd = std::sqrt(variance);
    return m;
}

AccuracyVerdict judge(const std::vector<AccuracyTable>& tables) {
    AccuracyVerdict verdict;
    for (const AccuracyTable& t : tables)
        for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
            for (std::size_t d = 0; d < t.depths_mm.size(); ++d) {
                if (t.depths_mm[d] <= t.tracker.position_rms_mm) continue;
                ++verdict.cells;
                const double rigid = over_seeds(t.by_sensors[k], d, &AccuracyErrors::rigid).mean;
                const double deforming =
                    over_seeds(t.by_sensors[k], d, &AccuracyErrors::deforming).mean;
                if (!(deforming < rigid))
                    verdict.lost.push_back(
                        fmt::format("noise {} mm, press {} mm, {}: {:.2f} against {:.2f} mm",
                                    t.tracker.position_rms_mm, t.depths_mm[d],
                                    counted(k + 1, "sensor"), deforming, rigid));
            }
    return verdict;
}

AccuracyVerdict judge_statement(const std::vector<AccuracyTable>& tables,
                                const std::vector<NamedSeries>& other_bodies) {
    AccuracyVerdict verdict;
    const auto add = [&](const std::string& name, int sensors, const AccuracySeries& series,
                         const std::vector<double>& depths_mm) {
        for (std::size_t d = 0; d < depths_mm.size(); ++d) {
            ++verdict.cells;
            const Coverage c = coverage_of(series, d);
            if (!c.is_right())
                verdict.lost.push_back(fmt::format("{}, press {} mm, {}: {}", name, depths_mm[d],
                                                   counted(sensors, "sensor"), text_of(c)));
        }
    };
    for (const AccuracyTable& t : tables)
        for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
            add(fmt::format("tracker of {} mm", t.tracker.position_rms_mm), static_cast<int>(k + 1),
                t.by_sensors[k], t.depths_mm);
    for (const NamedSeries& body : other_bodies)
        add(body.name, body.sensors, body.series, tables.front().depths_mm);
    return verdict;
}

void print(const AccuracyTable& t) {
    const std::size_t runs = t.by_sensors.front().runs.size();
    fmt::print("\ntracker of {} mm and {} degrees RMS, {} a cell: RMS error at the targets, mm{}\n",
               t.tracker.position_rms_mm, t.tracker.rotation_rms_deg, counted(runs, "run"),
               runs > 1 ? ", mean +- standard deviation" : "");
    fmt::print("{:>6} {:>12} {:>14}", "press", "true motion", "rigid-only");
    for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
        fmt::print(" {:>20}", counted(k + 1, "sensor") + " (gain)");
    fmt::print("\n");
    for (std::size_t d = 0; d < t.depths_mm.size(); ++d) {
        const MeanAndSpread rigid = over_seeds(t.by_sensors.front(), d, &AccuracyErrors::rigid);
        fmt::print("{:>6} {:>12.2f} {:>14}", t.depths_mm[d], t.motion_mm[d], text_of(rigid));
        for (const AccuracySeries& series : t.by_sensors) {
            const MeanAndSpread deforming = over_seeds(series, d, &AccuracyErrors::deforming);
            fmt::print(" {:>20}",
                       fmt::format("{} ({:.1f})", text_of(deforming), rigid.mean / deforming.mean));
        }
        fmt::print("\n");
    }
}

void print_statement(const AccuracyTable& t) {
    fmt::print(
        "\nits 95 % radius: share of the errors within it, median radius over median error\n{:>6}",
        "press");
    for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
        fmt::print(" {:>15}", counted(k + 1, "sensor"));
    fmt::print("\n");
    for (std::size_t d = 0; d < t.depths_mm.size(); ++d) {
        fmt::print("{:>6}", t.depths_mm[d]);
        for (const AccuracySeries& series : t.by_sensors)
            fmt::print(" {:>15}", text_of(coverage_of(series, d)));
        fmt::print("\n");
    }
    fmt::print("\nstated RMS error by source, mm\n{:>6} {:>7}", "press", "sensors");
    for (std::size_t q = 0; q < error_source_count; ++q)
        fmt::print(" {:>9}", name_of(static_cast<ErrorSource>(q)));
    fmt::print("   {:>12} {:>11}\n", "registration", "deformation");
    for (std::size_t d = 0; d < t.depths_mm.size(); ++d)
        for (const std::size_t k : first_and_last(t.by_sensors.size())) {
            fmt::print("{:>6} {:>7}", t.depths_mm[d], k + 1);
            for (std::size_t q = 0; q < error_source_count; ++q) {
                double squares = 0;
                for (const auto& run : t.by_sensors[k].runs)
                    squares += std::pow(run[d].by_source[q], 2) /
                               static_cast<double>(t.by_sensors[k].runs.size());
                fmt::print(" {:>9.3f}", std::sqrt(squares));
            }
            fmt::print("   {:>12.2f} {:>11.2f}\n",
                       over_seeds(t.by_sensors[k], d, &AccuracyErrors::registration).mean,
                       over_seeds(t.by_sensors[k], d, &AccuracyErrors::deformation).mean);
        }
}

void print_population(const std::vector<AccuracyTable>& tables, int bodies) {
    fmt::print(
        "\nbodies drawn from the spreads that the scene states: {}, all runs together in a cell\n",
        bodies);
    for (const AccuracyTable& t : tables) {
        print(t);
        print_statement(t);
    }
}

void print(const std::vector<NamedSeries>& limits, const std::vector<double>& depths_mm) {
    fmt::print(
        "\nwhat limits it: mean errors, mm: of the registration alone (any press), and deforming "
        "by press\n");
    fmt::print("{:<62} {:>7} {:>4} {:>12}", "", "sensors", "runs", "registration");
    for (const double depth : depths_mm) fmt::print(" {:>7}", fmt::format("{} mm", depth));
    fmt::print("\n");
    for (const NamedSeries& l : limits) {
        double registration = 0;
        for (std::size_t d = 0; d < depths_mm.size(); ++d)
            registration += over_seeds(l.series, d, &AccuracyErrors::registration).mean /
                            static_cast<double>(depths_mm.size());
        fmt::print("{:<62} {:>7} {:>4} {:>12.2f}", l.name, l.sensors, l.series.runs.size(),
                   registration);
        for (std::size_t d = 0; d < depths_mm.size(); ++d)
            fmt::print(" {:>7.2f}", over_seeds(l.series, d, &AccuracyErrors::deforming).mean);
        fmt::print("\n");
    }
}

void print_other_bodies(const std::vector<NamedSeries>& bodies,
                        const std::vector<double>& depths_mm) {
    fmt::print(
        "\nother bodies, which the model takes for the one above: share of the errors within the "
        "95 % radius, median radius over median error\n{:<50} {:>7} {:>4}",
        "", "sensors", "runs");
    for (const double depth : depths_mm) fmt::print(" {:>12}", fmt::format("{} mm", depth));
    fmt::print("\n");
    for (const NamedSeries& b : bodies) {
        fmt::print("{:<50} {:>7} {:>4}", b.name, b.sensors, b.series.runs.size());
        for (std::size_t d = 0; d < depths_mm.size(); ++d)
            fmt::print(" {:>12}", text_of(coverage_of(b.series, d)));
        fmt::print("\n");
    }
}

std::string csv_of(const std::vector<AccuracyTable>& tables) {
    std::string text =
        "position_rms_mm,rotation_rms_deg,sensors,run,press_mm,rigid_mm,deforming_mm,registration_"
        "mm,deformation_mm,covered,median_mm,radius_95_mm";
    for (const double level : stated_probabilities())
        text += fmt::format(",within_{:.0f}", 100 * level);
    text += "\n";
    for (const AccuracyTable& t : tables)
        for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
            for (std::size_t r = 0; r < t.by_sensors[k].runs.size(); ++r)
                for (std::size_t d = 0; d < t.depths_mm.size(); ++d) {
                    text += fmt::format("{},{},{},{},{}", t.tracker.position_rms_mm,
                                        t.tracker.rotation_rms_deg, k + 1, r + 1, t.depths_mm[d]);
                    for (const auto& [name, error] : errors_by_name)
                        text += fmt::format(",{:.4f}", t.by_sensors[k].runs[r][d].*error);
                    const AccuracyErrors& at = t.by_sensors[k].runs[r][d];
                    text += fmt::format(",{:.4f},{:.4f},{:.4f}", at.covered, at.median,
                                        at.median_radius);
                    for (const double share : at.within) text += fmt::format(",{:.4f}", share);
                    text += "\n";
                }
    return text;
}

json json_of(const AccuracyTable& t) {
    json by_sensors = json::array();
    for (std::size_t k = 0; k < t.by_sensors.size(); ++k)
        by_sensors.push_back({{"sensors", k + 1},
                              {"runs", t.by_sensors[k].runs.size()},
                              {"errors", json_of(t.by_sensors[k], t.depths_mm)}});
    return {{"position_rms_mm", t.tracker.position_rms_mm},
            {"rotation_rms_deg", t.tracker.rotation_rms_deg},
            {"true_motion_mm", t.motion_mm},
            {"by_sensors", by_sensors}};
}

json json_of(const NamedSeries& runs, const std::vector<double>& depths_mm) {
    return {{"name", runs.name},
            {"sensors", runs.sensors},
            {"runs", runs.series.runs.size()},
            {"errors", json_of(runs.series, depths_mm)}};
}

SpreadChart chart_of(const AccuracyTable& t) {
    SpreadChart chart{fmt::format("Tracker of {} mm and {} degrees RMS", t.tracker.position_rms_mm,
                                  t.tracker.rotation_rms_deg),
                      "press depth [mm]",
                      "error at the targets, RMS [mm]",
                      {}};
    const auto add = [&](const std::string& name, const AccuracySeries& series,
                         double AccuracyErrors::*error) {
        SpreadLine line{name, t.depths_mm, {}, {}};
        for (std::size_t d = 0; d < t.depths_mm.size(); ++d) {
            const MeanAndSpread m = over_seeds(series, d, error);
            line.mean.push_back(m.mean);
            line.spread.push_back(m.sd.value_or(0));
        }
        chart.lines.push_back(std::move(line));
    };
    add("rigid-only", t.by_sensors.front(), &AccuracyErrors::rigid);
    for (const std::size_t sensors : {1, 3, 6})
        if (sensors <= t.by_sensors.size())
            add("deforming, " + counted(sensors, "sensor"), t.by_sensors[sensors - 1],
                &AccuracyErrors::deforming);
    add("registration alone", t.by_sensors.front(), &AccuracyErrors::registration);
    return chart;
}

SpreadChart calibration_chart_of(const AccuracyTable& t) {
    SpreadChart chart{fmt::format("Tracker of {} mm and {} degrees RMS", t.tracker.position_rms_mm,
                                  t.tracker.rotation_rms_deg),
                      "stated probability [%]",
                      "errors that are no larger [%]",
                      {}};
    const auto levels = stated_probabilities();
    SpreadLine perfect{"perfect", {0, 100}, {0, 100}, {0, 0}};
    const auto add = [&](std::size_t depth, std::size_t k) {
        const AccuracySeries& series = t.by_sensors[k];
        SpreadLine line{
            fmt::format("{} mm, {}", t.depths_mm[depth], counted(k + 1, "sensor")), {}, {}, {}};
        const auto within = mean_within(series, depth);
        for (std::size_t i = 0; i < levels.size(); ++i) {
            line.x.push_back(100 * levels[i]);
            line.mean.push_back(100 * within[i]);
            line.spread.push_back(0);
        }
        chart.lines.push_back(std::move(line));
    };
    for (const std::size_t depth : first_and_last(t.depths_mm.size()))
        for (const std::size_t k : first_and_last(t.by_sensors.size())) add(depth, k);
    chart.lines.push_back(std::move(perfect));
    return chart;
}

}  // namespace livetet
