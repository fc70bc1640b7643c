#pragma once

#include <functional>
#include <optional>
#include <string>

#include "io/openigtlink/codec.hpp"

namespace livetet::igtl {

/// Bytes in pieces of any size into messages. A message that is wrong in itself (CRC, sizes,
/// counts, names), or of a later header version, is dropped and counted; one that is not wanted, or
/// of an unknown type, is passed over by its size. Of neither is anything kept that need not be.
/// What is kept grows with what has arrived, never with what a header promises.
class MessageParser {
  public:
    struct Counts {
        std::uint64_t messages = 0, passed_over = 0, bad_crc = 0, malformed = 0;
        std::string last_error;  ///< why the last message was dropped
    };
    using Sink = std::function<void(Message&&)>;
    using Wanted = std::function<bool(const Header&)>;

    /// `wanted` is asked once for each header; none wants every known type.
    explicit MessageParser(Wanted wanted = {}) : wanted_(std::move(wanted)) {}

    /// Takes the next bytes in and hands over each message that they complete. Throws Error where a
    /// header cannot be one
    /// (`decode_header`): nothing after that can be understood, and the connection must be closed.
    void feed(ByteView bytes, const Sink& sink);

    const Counts& counts() const { return counts_; }
    /// Whether a message has begun and not ended.
    bool inside_message() const { return header_ || !kept_.empty(); }

  private:
    void begin_message();
    void end_message(const Sink& sink);

    Wanted wanted_;
    Counts counts_;
    Bytes kept_;                    ///< of the header, then of the body
    std::optional<Header> header_;  ///< of the message whose body is under way
    std::uint64_t missing_ = header_size;
    bool keep_ = true;
};

}  // namespace livetet::igtl
