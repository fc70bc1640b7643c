#include "io/openigtlink/parser.hpp"

#include <algorithm>

#include "io/openigtlink/content.hpp"
#include "io/openigtlink/crc64.hpp"

namespace livetet::igtl {

void MessageParser::feed(ByteView bytes, const Sink& sink) {
    while (!bytes.empty()) {
        const ByteView piece = bytes.first(std::min<std::uint64_t>(missing_, bytes.size()));
        bytes = bytes.subspan(piece.size());
        missing_ -= piece.size();
        if (keep_) kept_.insert(kept_.end(), piece.begin(), piece.end());
        if (missing_ > 0) return;
        if (!header_) begin_message();
        if (missing_ == 0) end_message(sink);
    }
}

void MessageParser::begin_message() {
    header_ = decode_header(kept_);
    kept_.clear();
    missing_ = header_->body_size;
    keep_ = (!wanted_ || wanted_(*header_)) && header_->version <= newest_version &&
            blank_content(header_->type);
}

void MessageParser::end_message(const Sink& sink) {
    const Header header = std::move(*header_);
    const Bytes body = std::move(kept_);
    const bool kept = keep_;
    header_.reset();
    kept_.clear();
    missing_ = header_size;
    keep_ = true;
    if (header.version >
        newest_version) {  // reported, so that the sender does not just seem silent
        ++counts_.malformed;
        counts_.last_error = fmt::format("{}: version {} of the header, expected 1 to {}",
                                         header.type, header.version, newest_version);
        return;
    }
    if (!kept) {
        ++counts_.passed_over;
        return;
    }
    std::optional<Message> message;
    try {
        message = decode_body(header, body);
    } catch (const Error& error) {
        ++(crc64(body) == header.crc ? counts_.malformed : counts_.bad_crc);
        counts_.last_error = error.what();
        return;
    }
    ++counts_.messages;
    sink(std::move(*message));
}

}  // namespace livetet::igtl
