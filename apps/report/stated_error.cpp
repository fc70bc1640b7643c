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

ReportTable radius_table(const StatedErrors& stated) {
    ReportTable table{{"95 % radius", "median", "largest"}};
    table.note = "Within its 95 % radius a target is expected with 95 %.";
    if (std::ranges::any_of(stated.targets,
                            [](const StatedTarget& t) { return t.truth.has_value(); })) {
        table.heads.insert(table.heads.end(), {"true error within", "radius / error"});
        table.note +=
            " True error within: share of the frames, without a missing source, whose true error "
            "is at most the stated radius. Radius / error: of the medians over these frames.";
    }
    for (const StatedTarget& t : stated.targets) {
        std::vector<std::string>& cells = table.rows.emplace_back();
        cells = {t.name, fmt::format("{:.2f}", t.radius_95_mm.median),
                 fmt::format("{:.2f}", t.radius_95_mm.worst)};
        if (!t.truth) continue;
        const std::optional<double> ratio = t.truth->radius_per_error();
        cells.push_back(fmt::format("{:.1f} %", 100 * t.truth->coverage()));
        cells.push_back(ratio ? fmt::format("{:.2f}", *ratio) : "-");
    }
    return table;
}

ReportTable source_table(const StatedErrors& stated) {
    ReportTable table{{"RMS by source"}};
    for (std::size_t q = 0; q < error_source_count; ++q)
        table.heads.emplace_back(name_of(static_cast<ErrorSource>(q)));
    for (const StatedTarget& t : stated.targets) {
        std::vector<std::string>& cells = table.rows.emplace_back();
        cells = {t.name};
        for (const std::optional<double>& rms : t.rms_by_source_mm)
            cells.push_back(rms ? fmt::format("{:.2f}", *rms) : "-");
    }
    table.note = stated.incomplete == 0
                     ? "No source was missing in any frame."
                     : fmt::format("A source was missing in {:.1f} % of the frames: {}.",
                                   100.0 * static_cast<double>(stated.incomplete) /
                                       static_cast<double>(stated.frames),
                                   missing_text(stated));
    return table;
}

}  // namespace livetet
