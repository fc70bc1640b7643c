#include "apps/report.hpp"

#include <algorithm>

#include "base/error.hpp"

namespace livetet {

namespace {

Distribution distribution_of(const RunResult& result, double (*value)(const RunFrame&)) {
    std::vector<double> values;
    for (const RunFrame& frame : result.frames) values.push_back(value(frame));
    return distribution(std::move(values));
}

FrameStatistics frame_statistics(const RunResult& result) {
    FrameStatistics s;
    s.kept = result.frames.size();
    for (const RunFrame& frame : result.frames) {
        s.over_budget += frame.frame_ms > result.info.budget_ms;
        s.not_converged += !frame.converged;
        s.registration_held += frame.registration_held;
        s.registration_lost += frame.registration_lost;
    }
    s.frame_ms = distribution_of(result, [](const RunFrame& f) { return f.frame_ms; });
    s.operator_ms = distribution_of(result, [](const RunFrame& f) { return f.operator_ms; });
    s.forces_ms = distribution_of(result, [](const RunFrame& f) { return f.forces_ms; });
    s.solve_ms = distribution_of(result, [](const RunFrame& f) { return f.solve_ms; });
    s.iterations = distribution_of(result, [](const RunFrame& f) { return static_cast<double>(f.iterations); });
    return s;
}

}  // namespace

Report make_report(const RunResult& result, const Truth* truth) {
    if (result.frames.empty()) fail("{}: holds no frame, expected at least one", result.source);
    const auto deepest = std::max_element(result.frames.begin(), result.frames.end(),
                                          [](const RunFrame& a, const RunFrame& b) { return a.press_mm < b.press_mm; });
    Report report;
    report.source = result.source;
    report.run = result.info;
    report.frames = frame_statistics(result);
    report.first_s = result.frames.front().time_s;
    report.last_s = result.frames.back().time_s;
    report.largest_press_mm = deepest->press_mm;
    report.deepest_frame = static_cast<std::size_t>(deepest - result.frames.begin());
    if (truth) report.truth = compare_with_truth(result, *truth);
    return report;
}

}  // namespace livetet
