#pragma once

#include "io/openigtlink/bytes.hpp"
#include "io/openigtlink/message.hpp"

namespace livetet::igtl {

constexpr std::size_t header_size = 58;
constexpr std::size_t device_name_size = 20;
constexpr std::uint64_t max_body_size = std::uint64_t(256) << 20;

struct Header {
    std::uint16_t version = 1;
    std::string type, device;
    std::uint64_t time_stamp = 0, body_size = 0, crc = 0;
};

/// The first 58 bytes of a message. Throws Error where they cannot be one: version 0, a type that
/// is not printable ASCII, a body of more than `max_body_size`. After that a stream cannot be
/// followed any further.
Header decode_header(ByteView bytes);

/// The header versions that can be read. 3 is what drafts of protocol 3 called what became 2: the
/// same bytes, read as 2.
constexpr std::uint16_t newest_version = 3;

/// A body as its header says. Throws Error where the CRC is not that of the bytes, the version is
/// beyond `newest_version`, the sizes in it contradict each other, or the content is refused
/// (`decode_content`).
Message decode_body(const Header& header, ByteView body);

/// A whole message. A device's name is cut to 20 bytes; in version 2 the metadata
/// `IGTL_DEVICE_NAME` then has it whole. Throws Error where something does not fit its field.
Bytes encode(const Message& message);

/// The value of a metadata key, or nullptr.
const std::string* find_metadata(const Message& message, std::string_view key);

/// The device's whole name: `IGTL_DEVICE_NAME` in the metadata where that is a name (at most 128
/// bytes, no control characters), else the header's.
const std::string& whole_name(const Message& message);

/// A header's time stamp in seconds since 1970 (UTC), and back; resolves 0.3 microseconds.
double seconds_of_stamp(std::uint64_t time_stamp);
std::uint64_t stamp_of_seconds(double seconds);

}  // namespace livetet::igtl
