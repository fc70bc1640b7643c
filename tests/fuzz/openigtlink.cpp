// Fuzz targets for the path of an OpenIGTLink message: bytes in pieces, header, body, content,
// pose, sample; and the encoding of what was decoded.
#include <algorithm>
#include <stdexcept>

#include "fuzz/fuzz.hpp"
#include "io/openigtlink/crc64.hpp"
#include "io/openigtlink/gatherer.hpp"
#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/parser.hpp"

namespace livetet::fuzz {
namespace {

/// The same messages with a correct CRC, which random changes would never produce.
Bytes with_right_crcs(ByteView input) {
    Bytes bytes(input.begin(), input.end());
    for (std::size_t at = 0; at + igtl::header_size <= bytes.size();) {
        std::uint64_t size = 0;
        for (int i = 0; i < 8; ++i) size = size << 8 | bytes[at + 42 + i];
        if (size > bytes.size() - at - igtl::header_size) break;
        const std::uint64_t crc =
            igtl::crc64(ByteView(bytes).subspan(at + igtl::header_size, size));
        for (int i = 0; i < 8; ++i)
            bytes[at + 50 + i] = static_cast<std::uint8_t>(crc >> (56 - 8 * i));
        at += igtl::header_size + size;
    }
    return bytes;
}

/// A decoded message must encode, and decode to the same message.
void check_way_back(const igtl::Message& message) {
    Bytes once, twice;
    try {
        once = encode(message);
        const igtl::Message again =
            decode_body(igtl::decode_header(ByteView(once).first(igtl::header_size)),
                        ByteView(once).subspan(igtl::header_size));
        twice = encode(again);
    } catch (const Error& error) {
        throw std::logic_error(std::string("a message that was decoded cannot be encoded: ") +
                               error.what());
    }
    if (once != twice) throw std::logic_error(message.type + ": not the same after a second way");
}

void run(ByteView bytes) {
    double now_s = 100;
    PoseGatherer gatherer(
        {"Stylus", "Reference"}, {},
        [](const StreamSample& sample) {
            for (const TrackedPose& pose : sample.sample.poses)
                if (pose.status == PoseStatus::ok &&
                    !(pose.rotation.allFinite() && pose.translation.allFinite()))
                    throw std::logic_error("a pose that is ok and not finite");
        },
        now_s, now_s);
    igtl::MessageParser parser;
    const auto take = [&](igtl::Message&& message) {
        check_way_back(message);
        gatherer.take(message, now_s += 0.01);
        if (const auto* bind = std::get_if<igtl::Bind>(&message.content))
            for (const igtl::BoundMessage& bound : bind->messages)
                igtl::decode_content(bound.type, bound.content);
    };
    const std::size_t piece = bytes.empty() ? 1 : 1 + bytes[0] % 97;
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(piece, bytes.size())))
        parser.feed(bytes.first(std::min(piece, bytes.size())), take);
}

void run_both(ByteView input) {
    try {
        run(input);
    } catch (const Error&) {  // a wrong CRC must not hide what follows
    }
    run(with_right_crcs(input));
}

std::vector<Bytes> seeds() {
    std::vector<Bytes> all;
    Bytes joined;
    for (igtl::Message m : igtl::testing_messages::one_of_each())
        for (const std::uint16_t version : {1, 2}) {
            m.version = version;
            if (version == 2)
                m.metadata = {{"TransformStatus", 3, "OK"},
                              {"StylusTransformStatus", 3, "MISSING"}};
            m.device = "StylusToTracker";
            all.push_back(encode(m));
            joined.insert(joined.end(), all.back().begin(), all.back().end());
        }
    all.push_back(joined);
    return all;
}

}  // namespace

std::vector<Target> targets() { return {{"openigtlink", run_both, seeds}}; }

}  // namespace livetet::fuzz

/// Entry point for libFuzzer, whose changes are guided by coverage.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        livetet::fuzz::run_both({data, size});
    } catch (const livetet::Error&) {
    }
    return 0;
}
