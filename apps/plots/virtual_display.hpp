#pragma once

#include <optional>
#include <string>

namespace livetet {

/// True where an X server answers: without one, no picture can be drawn (VTK would end the
/// program).
bool have_display();

/// Sees to it that an X server answers: where there is none, one without a screen is started
/// (Xvfb), for this program alone and no longer than it. Why that cannot be; nothing where it can.
std::optional<std::string> find_display();

/// The same; throws Error that begins with `what`, which wants one.
void need_display(const std::string& what);

}  // namespace livetet
