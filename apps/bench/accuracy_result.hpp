#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/bench/accuracy_run.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

struct TrackerKind {
    double position_rms_mm, rotation_rms_deg;
};

/// Many runs, the same but for their seeds.
struct AccuracySeries {
    std::vector<std::vector<AccuracyErrors>> runs;  ///< of each seed, at each depth
};

struct MeanAndSpread {
    double mean = 0, sd = 0;  ///< sd: the sample's standard deviation, 0 of one value
};

/// One of the errors at a depth, over the seeds.
MeanAndSpread over_seeds(const AccuracySeries& series, std::size_t depth,
                         double AccuracyErrors::*error);

/// All runs with one tracker: `by_sensors[k]` with k + 1 deformation sensors. The seeds, so the
/// rigid-only errors, are the same for all of them.
struct AccuracyTable {
    TrackerKind tracker;
    std::vector<double> depths_mm;
    std::vector<double> motion_mm;  ///< how far the judged targets truly move, RMS, at each depth
    std::vector<AccuracySeries> by_sensors;
};

/// How many cells (a depth larger than the tracker's noise, a number of sensors) there are, and in
/// which of them the mean deforming error is not below the mean rigid-only one.
struct AccuracyVerdict {
    int cells = 0;
    std::vector<std::string> lost;
};
AccuracyVerdict judge(const std::vector<AccuracyTable>& tables);

/// What is left of the error when causes of it are taken away.
struct AccuracyLimit {
    std::string name;
    int sensors = 1;
    AccuracySeries series;
};

void print(const AccuracyTable& table);
void print(const std::vector<AccuracyLimit>& limits, const std::vector<double>& depths_mm);

std::string csv_of(const std::vector<AccuracyTable>& tables);
nlohmann::json json_of(const AccuracyTable& table);
nlohmann::json json_of(const AccuracyLimit& limit, const std::vector<double>& depths_mm);

/// Rigid-only, and deforming with few and with many sensors, against the depth of the press.
SpreadChart chart_of(const AccuracyTable& table);

}  // namespace livetet
