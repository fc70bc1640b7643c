#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/report/report_parts.hpp"
#include "apps/report/target_error.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// A stated target against the target of the same name in the truth, over the frames with a
/// registration and without a missing source: other radii are known to be too small.
struct StatedAgainstTruth {
    std::size_t frames = 0, within = 0;  ///< within: true error at most the stated radius
    double median_radius_mm = 0, median_error_mm = 0;

    double coverage() const { return static_cast<double>(within) / static_cast<double>(frames); }
    /// Ratio of the medians; none if there is no error.
    std::optional<double> radius_per_error() const;
};

/// What the frames of a run state of a target.
struct StatedTarget {
    std::string name;
    Distribution radius_95_mm;
    /// Over the frames in which the source was not missing; none: it was missing in all.
    std::array<std::optional<double>, error_source_count> rms_by_source_mm;
    /// If the truth has a target of this name, and there are frames to compare.
    std::optional<StatedAgainstTruth> truth;
};

/// What the frames of a run state of its targets.
struct StatedErrors {
    std::size_t frames = 0, incomplete = 0;  ///< incomplete: frames in which a source was missing
    std::array<std::size_t, error_source_count> missing{};  ///< frames, for each source
    std::vector<StatedTarget> targets;
};

/// Summarises the statements of a result; none if it has no targets.
std::optional<StatedErrors> summarise_statements(const RunResult& result,
                                                 const TargetErrors* truth = nullptr);

/// "elements in 12, law in 3": the sources that were missing, with the number of frames; empty if
/// none was.
std::string missing_text(const StatedErrors& stated);

/// Of each target the 95 % radii and, if the truth is known, how they compare with it.
ReportTable radius_table(const StatedErrors& stated);

/// Of each target the error by source, and which sources were missing.
ReportTable source_table(const StatedErrors& stated);

}  // namespace livetet
