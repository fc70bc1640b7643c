#include "apps/commands/publish_option.hpp"

#include "base/error.hpp"

namespace livetet {

void take_publish(const std::string& text, std::optional<PublishOptions>& publish) {
    if (text.empty()) return;
    if (!publish) publish.emplace();
    const std::size_t colon = text.rfind(':');
    std::string address = colon == std::string::npos ? "" : text.substr(0, colon);
    if (address.starts_with('[') && address.ends_with(']'))
        address = address.substr(1, address.size() - 2);
    if (!address.empty()) publish->address = address;
    const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
    const bool digits = !port.empty() && port.size() <= 5 &&
                        port.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || std::stoi(port) > 65535)
        fail("--publish {}: expected a port from 0 to 65535, or ADDRESS:PORT", text);
    publish->port = std::stoi(port);
}

}  // namespace livetet
