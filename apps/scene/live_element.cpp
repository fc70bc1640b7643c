#include "apps/scene/live_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace livetet {

namespace {

constexpr std::string_view corotated = "corotated", neohookean = "neohookean";

// Grouped by element and law, from few tets to many.
constexpr std::array<LiveFrontRow, 12> front_rows{{
    {Elements::p1, corotated, 6019, 0.45e-3, 0.043},
    {Elements::p1, corotated, 20117, 1.54e-3, 0.030},
    {Elements::p1, corotated, 60330, 3.3e-3, 0.039},
    {Elements::p1, neohookean, 6019, 0.58e-3, 0.048},
    {Elements::p1, neohookean, 20117, 1.6e-3, 0.028},
    {Elements::p1, neohookean, 60330, 4.1e-3, 0.0203},
    {Elements::p2, corotated, 2497, 0.90e-3, 0.046},
    {Elements::p2, corotated, 6019, 1.6e-3, 0.035},
    {Elements::p2, corotated, 15154, 4.8e-3, 0.053},
    {Elements::p2, neohookean, 2497, 1.07e-3, 0.024},
    {Elements::p2, neohookean, 6019, 1.8e-3, 0.023},
    {Elements::p2, neohookean, 15154, 4.0e-3, 0.0177},
}};

constexpr double usual_frame_s = 0.010;

/// Between two rows, at the share of the way by the logarithm of tets or of time.
LiveFrontRow row_between(const LiveFrontRow& a, const LiveFrontRow& b, double share) {
    const auto mean = [share](double x, double y) {
        return std::exp(std::lerp(std::log(x), std::log(y), share));
    };
    return {a.elements, a.law, mean(a.tets, b.tets), mean(a.frame_s, b.frame_s),
            mean(a.error, b.error)};
}

/// The row where `member` has the value; none outside of the measured ones.
std::optional<LiveFrontRow> row_at(std::span<const LiveFrontRow> measured,
                                   double LiveFrontRow::*member, double value) {
    for (std::size_t k = 1; k < measured.size(); ++k) {
        const double low = measured[k - 1].*member, high = measured[k].*member;
        if (value >= low && value <= high)
            return row_between(measured[k - 1], measured[k],
                               std::log(value / low) / std::log(high / low));
    }
    return {};
}

std::string text_of_row(const LiveFrontRow& row) {
    return fmt::format("{:.0f} tets of {} nodes, {}: {:.1f} % of the press, {:.1f} ms", row.tets,
                       row.elements == Elements::p2 ? "ten" : "four", row.law, 100 * row.error,
                       1e3 * row.frame_s);
}

}  // namespace

std::span<const LiveFrontRow> live_front(Elements elements, std::string_view law) {
    const auto is_of = [&](const LiveFrontRow& r) {
        return r.elements == elements && r.law == law;
    };
    const auto begin = std::find_if(front_rows.begin(), front_rows.end(), is_of);
    return {begin, std::find_if_not(begin, front_rows.end(), is_of)};
}

std::string_view measured_law(std::string_view law) {
    return law == corotated ? corotated : neohookean;
}

std::optional<LiveFrontRow> expected_frame(Elements elements, std::string_view law, double tets) {
    return row_at(live_front(elements, law), &LiveFrontRow::tets, tets);
}

std::optional<LiveFrontRow> best_live_element(double frame_s, std::string_view law) {
    std::optional<LiveFrontRow> best;
    const auto try_row = [&](const LiveFrontRow& row) {
        if (row.frame_s <= frame_s && (!best || row.error < best->error)) best = row;
    };
    for (const Elements elements : {Elements::p1, Elements::p2})
        for (const std::string_view l : {corotated, neohookean}) {
            if (!law.empty() && l != law) continue;
            const std::span<const LiveFrontRow> measured = live_front(elements, l);
            for (const LiveFrontRow& row : measured) try_row(row);
            if (auto row = row_at(measured, &LiveFrontRow::frame_s, frame_s)) {
                row->frame_s = std::min(row->frame_s, frame_s);  // but for round-off
                try_row(*row);
            }
        }
    return best;
}

std::string describe_live_element(const Scene& scene, std::size_t tets,
                                  std::optional<double> frame_s) {
    std::string_view source = "asked for";
    if (!frame_s && scene.track) {
        frame_s = seconds_of(scene.track->budget);
        source = "track.budget";
    }
    if (!frame_s) {
        frame_s = usual_frame_s;
        source = "track.budget is not set";
    }
    const std::string_view own = scene.strain.name(), law = measured_law(own);
    std::string text =
        fmt::format("Live element, within {:g} ms a frame ({})\n", 1e3 * *frame_s, source);
    const auto line = [&](std::string_view head, const std::optional<LiveFrontRow>& row,
                          std::string_view otherwise) {
        text +=
            fmt::format("  {:<18} {}\n", head, row ? text_of_row(*row) : std::string(otherwise));
    };
    constexpr std::string_view none = "no row that was measured is so fast";
    line("least error", best_live_element(*frame_s), none);
    line(fmt::format("with {}", law), best_live_element(*frame_s, law), none);
    line("the scene's", expected_frame(scene.elements, law, static_cast<double>(tets)),
         fmt::format("{} tets of {} nodes, {}: outside of what was measured", tets,
                     scene.elements == Elements::p2 ? "ten" : "four", law));
    if (law != own)
        text +=
            fmt::format("  Frames with {} were not measured: the figures are of {}.\n", own, law);
    text +=
        "  Whole errors of an organ of 570 ml pressed by 15 mm at nu 0.45, on two cores at 55 "
        "GB/s.\n  `livetet bench realtime --size front` measures this machine, `livetet tune` a "
        "scene.\n";
    return text;
}

}  // namespace livetet
