#include "base/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace livetet {

namespace {

spdlog::logger& logger() {
    static const std::shared_ptr<spdlog::logger> logger = [] {
        constexpr const char* name = "livetet";
        if (auto registered = spdlog::get(name)) return registered;
        auto made = spdlog::stderr_logger_mt(name);
        made->set_pattern("%v");
        return made;
    }();
    return *logger;
}

}  // namespace

void log_debug(const std::string& text) { logger().debug(text); }
void log_info(const std::string& text) { logger().info(text); }
void log_warning(const std::string& text) { logger().warn(text); }

void set_log_prefix(const std::string& prefix) { logger().set_pattern(prefix + ": %v"); }

}  // namespace livetet
