#include "apps/report/stated_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

std::optional<double> rms_mm(const RunResult& result, std::size_t target, ErrorSource source) {
    double squares = 0;
    std::size_t count = 0;
    for (const RunFrame& frame : result.frames) {
        if (frame.statement.missing.has(source)) continue;
        squares += frame.statement.targets[target].by_source[static_cast<std::size_t>(source)];
        ++count;
    }
    if (count == 0) return std::nullopt;
    return 1e3 * std::sqrt(squares / static_cast<double>(count));
}

std::optional<StatedAgainstTruth> against_truth(const RunResult& result, std::size_t target,
                                                const TargetErrors& truth) {
    const auto found =
        std::ranges::find(truth.series, result.targets[target], &TargetErrorSeries::name);
    if (found == truth.series.end()) return std::nullopt;
    StatedAgainstTruth compared;
    std::vector<double> radii, errors;
    for (std::size_t i = 0; i < truth.frames.size(); ++i) {
        const FrameStatement& statement = result.frames[truth.frames[i]].statement;
        if (!statement.missing.empty()) continue;
        errors.push_back(found->error_mm[i]);
        radii.push_back(1e3 * statement.targets[target].radius_95);
        compared.within += errors.back() <= radii.back();
    }
    if (radii.empty()) return std::nullopt;
    compared.frames = radii.size();
    compared.median_radius_mm = distribution(std::move(radii)).median;
    compared.median_error_mm = distribution(std::move(errors)).median;
    return compared;
}

}  // namespace

std::optional<double> StatedAgainstTruth::radius_per_error() const {
    if (!(median_error_mm > 0)) return std::nullopt;
    return median_radius_mm / median_error_mm;
}

std::optional<StatedErrors> summarise_statements(const RunResult& result,
                                                 const TargetErrors* truth) {
    if (result.targets.empty()) return std::nullopt;
    StatedErrors stated;
    stated.frames = result.frames.size();
    for (const RunFrame& frame : result.frames) {
        stated.incomplete += !frame.statement.missing.empty();
        for (std::size_t q = 0; q < error_source_count; ++q)
            stated.missing[q] += frame.statement.missing.has(static_cast<ErrorSource>(q));
    }
    for (std::size_t i = 0; i < result.targets.size(); ++i) {
        StatedTarget& target = stated.targets.emplace_back();
        target.name = result.targets[i];
        std::vector<double> radii;
        for (const RunFrame& frame : result.frames)
            radii.push_back(1e3 * frame.statement.targets[i].radius_95);
        target.radius_95_mm = distribution(std::move(radii));
        for (std::size_t q = 0; q < error_source_count; ++q)
            target.rms_by_source_mm[q] = rms_mm(result, i, static_cast<ErrorSource>(q));
        if (truth) target.truth = against_truth(result, i, *truth);
    }
    return stated;
}

std::string missing_text(const StatedErrors& stated) {
    std::string text;
    for (std::size_t q = 0; q < error_source_count; ++q)
        if (stated.missing[q] > 0)
            text += fmt::format("{}{} in {}", text.empty() ? "" : ", ",
                                name_of(static_cast<ErrorSource>(q)), stated.missing[q]);
    return text;
}

}  // namespace livetet
