#pragma once

#include <optional>

#include "io/openigtlink/bytes.hpp"
#include "io/openigtlink/message.hpp"

namespace livetet::igtl {

/// The alternative of `Content` that a type of message has, with nothing in it; nothing where the
/// type is not known.
std::optional<Content> blank_content(std::string_view type);

/// The content of a message of this type: what is in the body between extended header and metadata.
/// Throws Error where the type is not known, sizes and counts do not agree with the bytes, an index
/// points nowhere, or bytes are left over.
Content decode_content(std::string_view type, ByteView bytes);

/// The way back. Throws Error where the content is not the type's or does not fit its fields.
Bytes encode_content(std::string_view type, const Content& content);

}  // namespace livetet::igtl
