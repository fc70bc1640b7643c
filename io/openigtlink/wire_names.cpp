#include "io/openigtlink/wire_names.hpp"

#include "io/openigtlink/codec.hpp"

namespace livetet {

void WireNames::assign(igtl::Message& message) {
    const std::string& sent = sent_as(message.type, message.device);
    if (sent == message.device) return;
    if (!find_metadata(message, igtl::device_name_key))
        message.metadata.push_back({std::string(igtl::device_name_key), 3, message.device});
    message.device = sent;
}

const std::string& WireNames::sent_as(const std::string& type, const std::string& device) {
    const auto [place, is_new] = sent_.try_emplace({type, device});
    if (!is_new) return place->second;
    std::string name = device.substr(0, igtl::device_name_size);
    for (int number = 2; !taken_.try_emplace({type, name}, device).second; ++number) {
        const std::string end = fmt::format("_{}", number);
        name = device.substr(0, igtl::device_name_size - end.size()) + end;
    }
    place->second = name;
    if (tell_ && !device.starts_with(name))
        tell_(fmt::format(
            "{} is sent as {}: OpenIGTLink has 20 bytes for a name, and {} begins with the same; "
            "clients of version 2 receive the whole name",
            device, name, taken_.at({type, device.substr(0, igtl::device_name_size)})));
    return place->second;
}

}  // namespace livetet
