#pragma once

#include "apps/plots/off_screen_window.hpp"

namespace livetet {

/// Colours of the marks.
namespace mark_colour {
inline constexpr look::Colour fixed{0.25, 0.25, 0.28}, patch = look::red, sensor = look::red,
                                                       base{0.95, 0.65, 0.10};
inline constexpr look::Colour tool{0.10, 0.45, 0.80}, fiducial{0.10, 0.65, 0.25},
    touched{0.60, 0.20, 0.70}, pull{0.90, 0.10, 0.70}, target{1.0, 0.40, 0.0};
inline constexpr look::Colour outline{1.0, 0.85, 0.2}, rest{0.35, 0.55, 0.75},
    cross{0.2, 0.75, 0.75}, unknown{0.16, 0.10, 0.28};
}  // namespace mark_colour

}  // namespace livetet
