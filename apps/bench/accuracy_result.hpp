#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/accuracy_run.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

/// Noise of a tracker, RMS.
struct TrackerKind {
    double position_rms_mm, rotation_rms_deg;
};

/// Runs that differ only in their seeds.
struct AccuracySeries {
    std::vector<std::vector<AccuracyErrors>> runs;  ///< for each seed, at each depth
};

struct MeanAndSpread {
    double mean = 0;
    std::optional<double> sd{};  ///< sample standard deviation; none for a single value
};

/// Statistics over the seeds of one of the errors at a depth.
MeanAndSpread over_seeds(const AccuracySeries& series, std::size_t depth,
                         double AccuracyErrors::*error);

/// All runs with one tracker: `by_sensors[k]` with k + 1 deformation sensors. The seeds, and so the
/// rigid-only errors, are the same for each.
struct AccuracyTable {
    TrackerKind tracker;
    std::vector<double> depths_mm;
    std::vector<double> motion_mm;  ///< true motion of the judged targets, RMS, at each depth
    std::vector<AccuracySeries> by_sensors;
};

/// Number of cells (a depth above the tracker's noise, a number of sensors), and those in which the
/// mean deforming error is not below the mean rigid-only one.
struct AccuracyVerdict {
    int cells = 0;
    std::vector<std::string> lost;
};
AccuracyVerdict judge(const std::vector<AccuracyTable>& tables);

/// Runs with a name: the error that remains after causes of it are removed, or that of another
/// body.
struct NamedSeries {
    std::string name;
    int sensors = 1;
    AccuracySeries series;
};

/// Cells of tables and other bodies, and those in which the 95 % radius covers less than 92 or more
/// than 98 % of the errors, or its median is more than 2.5 times theirs.
AccuracyVerdict judge_statement(const std::vector<AccuracyTable>& tables,
                                const std::vector<NamedSeries>& other_bodies);

void print(const AccuracyTable& table);
/// How the stated errors compare with the true ones.
void print_statement(const AccuracyTable& table);
/// The errors and the statement over `bodies` drawn bodies, a table for each tracker.
void print_population(const std::vector<AccuracyTable>& tables, int bodies);
void print(const std::vector<NamedSeries>& limits, const std::vector<double>& depths_mm);
/// The statement on bodies that are not as the model takes them to be.
void print_other_bodies(const std::vector<NamedSeries>& bodies,
                        const std::vector<double>& depths_mm);

std::string csv_of(const std::vector<AccuracyTable>& tables);
nlohmann::json json_of(const AccuracyTable& table);
nlohmann::json json_of(const NamedSeries& runs, const std::vector<double>& depths_mm);

/// Errors against the depth of the press: rigid-only, and deforming with few and with many sensors.
SpreadChart chart_of(const AccuracyTable& table);
/// Share of the errors that are no larger than stated with a probability, against that probability:
/// the diagonal if the statement is right.
SpreadChart calibration_chart_of(const AccuracyTable& table);

}  // namespace livetet
