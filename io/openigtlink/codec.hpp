#pragma once

#include "io/openigtlink/bytes.hpp"
#include "io/openigtlink/message.hpp"

namespace livetet::igtl {

constexpr std::size_t header_size = 58;
constexpr std::size_t device_name_size = 20;
/// Key of the metadata item with the whole device name.
constexpr std::string_view device_name_key = "IGTL_DEVICE_NAME";
constexpr std::uint64_t max_body_size = std::uint64_t(256) << 20;

/// A message header; `device` is cut to 20 bytes on the wire.
struct Header {
    std::uint16_t version = 1;
    std::string type, device;
    std::uint64_t time_stamp = 0, body_size = 0, crc = 0;
};

/// Decodes a header, the first 58 bytes of a message. Throws Error if they cannot be a header:
/// version 0, a type that is not printable ASCII, or a body of more than `max_body_size`. The
/// stream cannot be resynchronised after that.
Header decode_header(ByteView bytes);

/// The newest readable header version. Version 3 is what drafts of protocol 3 called the later
/// version 2: the same bytes, read as version 2.
constexpr std::uint16_t newest_version = 3;

/// Decodes a message body according to its header. Throws Error if the CRC does not match, the
/// version is beyond `newest_version`, the sizes in the body contradict each other, or
/// `decode_content` throws.
Message decode_body(const Header& header, ByteView body);

/// Encodes a whole message. A device name longer than 20 bytes is cut; in version 2 the metadata
/// item `IGTL_DEVICE_NAME` then has the full name. Throws Error if a value does not fit its field.
Bytes encode(const Message& message);

/// The value of a metadata key; nullptr if the message has none.
const std::string* find_metadata(const Message& message, std::string_view key);

/// The full device name: the metadata item `IGTL_DEVICE_NAME` if it is valid (at most 128 bytes, no
/// control characters), else the header's name.
const std::string& whole_name(const Message& message);

/// Converts a header's time stamp to seconds since 1970 (UTC), and back. A double resolves 0.3
/// microseconds.
double seconds_of_stamp(std::uint64_t time_stamp);
std::uint64_t stamp_of_seconds(double seconds);

}  // namespace livetet::igtl
