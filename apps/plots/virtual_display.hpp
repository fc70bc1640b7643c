#pragma once

#include <optional>
#include <string>

namespace livetet {

/// Whether an X server answers. Without one, VTK ends the program when it draws.
bool have_display();

/// Makes an X server available: if there is none, starts one without a screen (Xvfb), for this
/// program alone and no longer than it. Returns why that failed, or nothing.
std::optional<std::string> find_display();

/// Calls find_display; throws Error beginning with `what` if it fails.
void need_display(const std::string& what);

}  // namespace livetet
