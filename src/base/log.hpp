#pragma once

#include <string>

namespace livetet {

// Messages of library code go to the spdlog logger "livetet", a line each. By default it writes the
// text alone to stderr and leaves debug messages out; a program that embeds the library can change
// its level and sinks (`spdlog::get("livetet")` once a message was logged), or register one of this
// name before. Results are not logged: commands print them. May be called from any thread.
void log_debug(const std::string& text);
void log_info(const std::string& text);
void log_warning(const std::string& text);

/// From now on each message begins with "PREFIX: ".
void set_log_prefix(const std::string& prefix);

}  // namespace livetet
