#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "apps/scene/scene.hpp"

namespace livetet {

/// A row of the measured front: frames of the live solver with one cycle, and their whole error.
struct LiveFrontRow {
    Elements elements;
    std::string_view law;
    double tets;
    double frame_s;  ///< median
    double error;    ///< RMS over targets and frames, as a part of the press
};

/// The measured rows of one kind of tets and one law, from few tets to many; empty where nothing
/// was measured. Source: `livetet bench realtime --size front` on two cores at 55 GB/s, the table
/// in docs/theory/live-solver.md: the phantom of 570 ml, pressed by 15 mm at 1 Hz,
/// sixty frames a second, nu 0.45.
std::span<const LiveFrontRow> live_front(Elements elements, std::string_view law);

/// The law whose rows stand for `law`: itself if it was measured, else neo-Hookean.
std::string_view measured_law(std::string_view law);

/// The row that is expected of so many tets: between the measured ones log time and log error are
/// linear in log tets. None outside of what was measured.
std::optional<LiveFrontRow> expected_frame(Elements elements, std::string_view law, double tets);

/// What has the least error within a frame time: of both kinds of tets, and of the laws that were
/// measured or, if `law` is given, of that one alone. Between measured rows it is interpolated; it
/// never has more tets than were measured. None if even the fastest row takes longer.
std::optional<LiveFrontRow> best_live_element(double frame_s, std::string_view law = {});

/// Lines for `explain` and `tune`: which element and number of tets have the least whole error
/// within the frame time of a `track` scene, with any law and with its own, and what is expected of
/// the scene as it is, with `tets` tets. `frame_s`: none: track.budget, or 10 ms.
std::string describe_live_element(const Scene& scene, std::size_t tets,
                                  std::optional<double> frame_s = {});

}  // namespace livetet
