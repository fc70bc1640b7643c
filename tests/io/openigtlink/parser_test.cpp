#include "io/openigtlink/parser.hpp"

#include <gtest/gtest.h>

#include <random>

#include "io/files.hpp"
#include "io/openigtlink/messages.hpp"

namespace livetet::igtl {
namespace {

using testing_files::error_of;
using testing_files::says;
using namespace testing_messages;

Bytes joined(const std::vector<Message>& messages) {
    Bytes all;
    for (const Message& m : messages) {
        const Bytes bytes = encode(m);
        all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
}

std::vector<std::string> types_of(MessageParser& parser, ByteView bytes, std::size_t chunk) {
    std::vector<std::string> types;
    while (!bytes.empty()) {
        const ByteView piece = bytes.first(std::min(chunk, bytes.size()));
        bytes = bytes.subspan(piece.size());
        parser.feed(piece, [&](Message&& m) { types.push_back(m.type); });
    }
    return types;
}

TEST(OpenIgtLinkParser, FindsTheSameMessagesInPiecesOfAnySize) {
    const Bytes all = joined(one_of_each());
    for (const std::size_t chunk :
         {std::size_t(1), std::size_t(7), std::size_t(58), std::size_t(1000), all.size()}) {
        MessageParser parser;
        EXPECT_EQ(types_of(parser, all, chunk).size(), one_of_each().size()) << chunk;
        EXPECT_FALSE(parser.inside_message());
        EXPECT_EQ(parser.counts().malformed + parser.counts().bad_crc + parser.counts().passed_over,
                  0);
    }
}

TEST(OpenIgtLinkParser, DropsAMessageWithAWrongCrcAndGoesOnWithTheNext) {
    Bytes all = joined({message("TRANSFORM", Transform{}), message("STRING", String{3, "x"})});
    all[header_size + 5] ^= 0x10;
    MessageParser parser;
    EXPECT_EQ(types_of(parser, all, 10), std::vector<std::string>{"STRING"});
    EXPECT_EQ(parser.counts().bad_crc, 1);
    EXPECT_EQ(parser.counts().malformed, 0);
    EXPECT_TRUE(says(parser.counts().last_error, {"TRANSFORM", "CRC"}));
}

TEST(OpenIgtLinkParser, PassesOverUnknownTypesVersionsAndWhatIsNotWanted) {
    Bytes all =
        joined({message("TRANSFORM", Transform{}), message("TRANSFORM", Transform{}),
                message("IMAGE", Image{1, 1, 3, 1, 1, {2, 2, 2}, {}, {}, {2, 2, 2}, Bytes(8)}),
                message("STRING", String{3, "x"})});
    all[2] = 'X';                   // XRANSFORM
    all[header_size + 48 + 1] = 7;  // a later version
    MessageParser parser([](const Header& header) { return header.type != "IMAGE"; });
    EXPECT_EQ(types_of(parser, all, 33), std::vector<std::string>{"STRING"});
    EXPECT_EQ(parser.counts().passed_over, 2);
    EXPECT_EQ(parser.counts().malformed, 1)
        << "a later version is said, not passed over in silence";
    EXPECT_TRUE(says(parser.counts().last_error, {"TRANSFORM", "version 7", "expected 1 to 3"}));
    EXPECT_EQ(parser.counts().bad_crc, 0);
}

TEST(OpenIgtLinkParser, DropsAMalformedMessageAndSaysWhy) {
    Message m = message("TDATA", TrackingData{{{"Stylus", 2, {}}}});
    m.device = "two\nlines";
    MessageParser parser;
    EXPECT_EQ(types_of(parser, joined({m, message("STRING", String{3, "x"})}), 50),
              std::vector<std::string>{"STRING"});
    EXPECT_EQ(parser.counts().malformed, 1);
    EXPECT_TRUE(says(parser.counts().last_error, {"TDATA", "control characters"}));
}

TEST(OpenIgtLinkParser, AHeaderThatCannotBeOneThrows) {
    MessageParser parser;
    EXPECT_TRUE(says(error_of([&] { types_of(parser, Bytes(header_size, 'H'), 58); }),
                     {"expected at most"}));
}

TEST(OpenIgtLinkParser, AMessageOfNothingButAHeaderIsWholeAtOnce) {
    MessageParser parser;
    EXPECT_EQ(types_of(parser, encode(message("GET_POLYDATA", Raw{})), 1000),
              std::vector<std::string>{"GET_POLYDATA"});
}

}  // namespace
}  // namespace livetet::igtl
