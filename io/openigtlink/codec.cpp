#include "io/openigtlink/codec.hpp"

#include <cmath>

#include "io/openigtlink/content.hpp"
#include "io/openigtlink/crc64.hpp"

namespace livetet::igtl {

namespace {

constexpr std::size_t type_size = 12, extended_header_size = 12;
constexpr std::size_t longest_name = 128;

/// Sizes of the parts of a version-2 body. The content lies between the extended header and the
/// metadata.
struct ExtendedHeader {
    std::uint16_t size = extended_header_size, metadata_header_size = 2;
    std::uint32_t metadata_size = 0, id = 0;
};

ExtendedHeader read_extended_header(ByteReader& body) {
    ExtendedHeader x;
    body(x.size);
    body(x.metadata_header_size);
    body(x.metadata_size);
    body(x.id);
    if (x.size < extended_header_size)
        fail("{}: the extended header has {} bytes, expected at least {}", body.what(), x.size,
             extended_header_size);
    body.unused(x.size - extended_header_size);
    if (std::uint64_t(x.metadata_header_size) + x.metadata_size > body.left())
        fail("{}: the metadata has {} + {} bytes, expected at most {}", body.what(),
             x.metadata_header_size, x.metadata_size, body.left());
    return x;
}

std::vector<MetadataItem> read_metadata(ByteReader headers, ByteReader texts) {
    std::vector<MetadataItem> items;
    if (headers.left() == 0) return items;  // some senders omit a count of zero
    const auto count = headers.number<std::uint16_t>();
    for (int i = 0; i < count; ++i) {
        const auto key_size = headers.number<std::uint16_t>();
        MetadataItem& item = items.emplace_back();
        headers(item.encoding);
        const auto value_size = headers.number<std::uint32_t>();
        texts.text(item.key, key_size);
        texts.text(item.value, value_size);
    }
    headers.end();
    texts.end();
    return items;
}

void write_body_2(ByteWriter& out, const Message& message, const Bytes& content) {
    std::vector<MetadataItem> items = message.metadata;
    if (message.device.size() > device_name_size && !find_metadata(message, device_name_key))
        items.push_back({std::string(device_name_key), 3, message.device});
    std::uint64_t size = 0;
    for (const MetadataItem& item : items) size += item.key.size() + item.value.size();

    out(static_cast<std::uint16_t>(extended_header_size));
    out.count<std::uint16_t>(2 + 8 * items.size());
    out.count<std::uint32_t>(size);
    out(message.id);
    out.bytes(content, content.size());
    out.count<std::uint16_t>(items.size());
    for (const MetadataItem& item : items) {
        out.count<std::uint16_t>(item.key.size());
        out(item.encoding);
        out.count<std::uint32_t>(item.value.size());
    }
    for (const MetadataItem& item : items) {
        out.text(item.key, item.key.size());
        out.text(item.value, item.value.size());
    }
}

Bytes encode_body(const Message& message) {
    Bytes content = encode_content(message.type, message.content);
    if (message.version == 1) return content;
    if (message.version != 2)
        fail("{}: version {} of the header, expected 1 or 2", message.type, message.version);
    ByteWriter out(message.type);
    write_body_2(out, message, content);
    return out.take();
}

}  // namespace

Header decode_header(ByteView bytes) {
    ByteReader in(bytes, "OpenIGTLink header");
    Header header;
    in(header.version);
    in.name(header.type, type_size);
    if (header.version == 0) fail("{}: version 0, expected 1 to {}", in.what(), newest_version);
    if (header.type.empty() || std::any_of(header.type.begin(), header.type.end(),
                                           [](unsigned char c) { return c > 0x7e; }))
        fail("{}: the type is not printable text", in.what());
    // The device name may be in any encoding; an error in it concerns this message only.
    in.text(header.device, device_name_size);
    if (const auto end = header.device.find('\0'); end != std::string::npos)
        header.device.resize(end);
    in(header.time_stamp);
    in(header.body_size);
    in(header.crc);
    in.end();
    if (header.body_size > max_body_size)
        fail("{}: {} with a body of {} bytes, expected at most {}", in.what(), header.type,
             header.body_size, max_body_size);
    return header;
}

Message decode_body(const Header& header, ByteView body) {
    if (body.size() != header.body_size)
        fail("{}: {} bytes of body, expected {}", header.type, body.size(), header.body_size);
    if (const auto crc = crc64(body); crc != header.crc)
        fail("{}: a CRC of {:016x}, expected {:016x}", header.type, header.crc, crc);
    if (header.version > newest_version)
        fail("{}: version {} of the header, expected 1 to {}", header.type, header.version,
             newest_version);
    Message message{
        std::min<std::uint16_t>(header.version, 2), header.type, {}, header.time_stamp, {}, 0, {}};
    const Bytes device(header.device.begin(), header.device.end());
    ByteReader(device, header.type).name(message.device, device.size());
    if (header.version == 1) {
        message.content = decode_content(header.type, body);
        return message;
    }
    ByteReader in(body, header.type);
    const ExtendedHeader x = read_extended_header(in);
    message.id = x.id;
    message.content =
        decode_content(header.type, in.take(in.left() - x.metadata_header_size - x.metadata_size));
    const ByteView metadata_header = in.take(x.metadata_header_size);
    message.metadata = read_metadata({metadata_header, header.type + ", metadata"},
                                     {in.take(x.metadata_size), header.type + ", metadata"});
    return message;
}

Bytes encode(const Message& message) {
    const Bytes body = encode_body(message);
    if (body.size() > max_body_size)
        fail("{}: a body of {} bytes, expected at most {}", message.type, body.size(),
             max_body_size);
    ByteWriter out(message.type);
    out(message.version);
    out.name(message.type, type_size);
    out.name(std::string_view(message.device).substr(0, device_name_size), device_name_size);
    out(message.time_stamp);
    out(static_cast<std::uint64_t>(body.size()));
    out(crc64(body));
    out.bytes(body, body.size());
    return out.take();
}

const std::string* find_metadata(const Message& message, std::string_view key) {
    for (const MetadataItem& item : message.metadata)
        if (item.key == key) return &item.value;
    return nullptr;
}

const std::string& whole_name(const Message& message) {
    const std::string* name = find_metadata(message, device_name_key);
    const bool good =
        name && !name->empty() && name->size() <= longest_name && !holds_controls(*name);
    return good ? *name : message.device;
}

double seconds_of_stamp(std::uint64_t time_stamp) {
    return static_cast<double>(time_stamp >> 32) +
           std::ldexp(static_cast<double>(time_stamp & 0xffffffff), -32);
}

std::uint64_t stamp_of_seconds(double seconds) {
    if (!(seconds > 0 && seconds < std::ldexp(1, 32))) return 0;
    return static_cast<std::uint64_t>(std::ldexp(seconds, 32));
}

}  // namespace livetet::igtl
