#pragma once

#include <functional>
#include <optional>
#include <string>

#include "io/openigtlink/codec.hpp"

namespace livetet::igtl {

/// Splits a byte stream into messages. A malformed message (CRC, sizes, counts, names) or one of a
/// later header version is dropped and counted. An unwanted message, or one of unknown type, is
/// skipped by its size without being stored. Memory grows with the received bytes, never with the
/// size that a header claims.
class MessageParser {
  public:
    struct Counts {
        std::uint64_t messages = 0, passed_over = 0, bad_crc = 0, malformed = 0;
        std::string last_error;  ///< why the last message was dropped
    };
    using Sink = std::function<void(Message&&)>;
    using Wanted = std::function<bool(const Header&)>;

    /// `wanted` is called once for each header; without it every known type is wanted.
    explicit MessageParser(Wanted wanted = {}) : wanted_(std::move(wanted)) {}

    /// Processes the next bytes and passes each completed message to `sink`. Throws Error for an
    /// invalid header (`decode_header`); the connection must then be closed.
    void feed(ByteView bytes, const Sink& sink);

    const Counts& counts() const { return counts_; }
    /// Whether a message is incomplete.
    bool inside_message() const { return header_ || !kept_.empty(); }

  private:
    void begin_message();
    void end_message(const Sink& sink);

    Wanted wanted_;
    Counts counts_;
    Bytes kept_;                    ///< bytes of the current header, then of the current body
    std::optional<Header> header_;  ///< header of the message whose body is being received
    std::uint64_t missing_ = header_size;
    bool keep_ = true;
};

}  // namespace livetet::igtl
