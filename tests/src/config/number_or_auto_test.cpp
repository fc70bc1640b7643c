#include "config/number_or_auto.hpp"

#include <gtest/gtest.h>

#include "config/yaml.hpp"

namespace livetet {
namespace {

struct WithNumberOrAuto {
    std::optional<NumberOrAuto> time_ms{};
};

template <class Visitor>
void visit_fields(Visitor& v, WithNumberOrAuto& o) {
    v.field("time_ms", o.time_ms, "ms", "a time",
            Check<NumberOrAuto>{"at least 0, or auto", [](const NumberOrAuto& x) {
                                    return x.is_auto() || *x.number >= 0;
                                }});
}

std::optional<NumberOrAuto> number_or_auto_of(const std::string& text) {
    return read_yaml<WithNumberOrAuto>(text, "scene.yaml").time_ms;
}

std::string refused_number_or_auto(const std::string& text) {
    try {
        (void)number_or_auto_of(text);
    } catch (const Error& error) {
        return error.what();
    }
    return "accepted";
}

TEST(NumberOrAuto, ReadsBackAsItIsWritten) {
    EXPECT_EQ(number_or_auto_of("{}"), std::nullopt);
    EXPECT_EQ(number_or_auto_of("time_ms: auto"), NumberOrAuto{});
    EXPECT_EQ(number_or_auto_of("time_ms: 12.5"), NumberOrAuto{12.5});
    EXPECT_EQ(number_or_auto_of("time_ms: 0"), NumberOrAuto{0});
    for (const NumberOrAuto x : {NumberOrAuto{}, NumberOrAuto{1.0 / 3}, NumberOrAuto{0}})
        EXPECT_EQ(number_or_auto_of(to_yaml(WithNumberOrAuto{x})), x);
}

TEST(NumberOrAuto, AnyOtherWordAndANumberOutOfRangeAreRefused) {
    EXPECT_EQ(refused_number_or_auto("time_ms: soon"),
              "time_ms = soon must be a number, or auto (scene.yaml:1)");
    EXPECT_EQ(refused_number_or_auto("time_ms: -1"),
              "time_ms = -1 ms must be at least 0, or auto (scene.yaml:1)");
    for (const char* text : {"time_ms: .nan", "time_ms: .inf", "time_ms:", "time_ms: Auto",
                             "time_ms: [1]", "time_ms: \"\""})
        EXPECT_NE(refused_number_or_auto(text), "accepted") << text;
}

}  // namespace
}  // namespace livetet
