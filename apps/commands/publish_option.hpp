#pragma once

#include <optional>
#include <string>

#include "apps/scene/track_options.hpp"

namespace livetet {

/// Help of the option.
inline constexpr const char* publish_help =
    "serve the deformed surface, tools and status by OpenIGTLink on this port, or ADDRESS:PORT; "
    "only this machine can connect unless an address is given";

/// The option --publish: "18945", "0.0.0.0:18945" or "[::]:18945" over what a scene says. Throws
/// Error for another text; an empty one changes nothing.
void take_publish(const std::string& text, std::optional<PublishOptions>& publish);

}  // namespace livetet
