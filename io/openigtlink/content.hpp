#pragma once

#include <optional>

#include "io/openigtlink/bytes.hpp"
#include "io/openigtlink/message.hpp"

namespace livetet::igtl {

/// The empty alternative of `Content` for a message type; nothing if the type is unknown.
std::optional<Content> blank_content(std::string_view type);

/// Decodes the content of a message of this type: the part of the body between extended header and
/// metadata. Throws Error if the type is unknown, if sizes and counts do not match the bytes, if an
/// index is out of range, or if bytes are left over.
Content decode_content(std::string_view type, ByteView bytes);

/// Encodes a content. Throws Error if it does not belong to the type or a value does not fit its
/// field.
Bytes encode_content(std::string_view type, const Content& content);

}  // namespace livetet::igtl
