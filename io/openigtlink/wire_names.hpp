#pragma once

#include <functional>
#include <map>
#include <string>

#include "io/openigtlink/message.hpp"

namespace livetet {

/// Gives messages device names that differ in the 20 bytes that the header has for them. A name
/// whose first 20 bytes are taken by another device of the same type ends in a number instead:
/// `LongInstrumentName_2`. The whole name is in the metadata of version 2.
class WireNames {
  public:
    /// `tell` is called once for each numbered name.
    explicit WireNames(std::function<void(const std::string& text)> tell = {})
        : tell_(std::move(tell)) {}

    /// Replaces the message's device name if it does not fit the header.
    void assign(igtl::Message& message);

  private:
    const std::string& sent_as(const std::string& type, const std::string& device);

    std::function<void(const std::string&)> tell_;
    using Key = std::pair<std::string, std::string>;  ///< type and name
    std::map<Key, std::string> sent_;                 ///< by the device's whole name
    std::map<Key, std::string> taken_;                ///< by the name in the header: whose it is
};

}  // namespace livetet
