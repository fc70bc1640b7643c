#include <gtest/gtest.h>

#include "apps/verification/suite.hpp"

namespace livetet::verification {
namespace {

std::vector<int> test_cases() {
    std::vector<int> numbers;
    for (std::size_t i = 0; i < cases().size(); ++i)
        if (cases()[i].role == Case::Role::test) numbers.push_back(static_cast<int>(i));
    return numbers;
}

class Verification : public testing::TestWithParam<int> {};

TEST_P(Verification, IsWithinItsToleranceAndOfItsOrder) {
    for (const Outcome& o : cases()[GetParam()].run()) {
        std::printf("%-75s %12.6g %12.6g %9.2e %s\n", o.name.c_str(), o.reference, o.last().value,
                    o.last().error,
                    o.expected_order > 0 ? std::to_string(o.observed_order()).c_str() : "");
        for (const auto& run : o.runs)
            std::printf("    %-20s %12.6g %9.2e %6.2f s\n", run.size.c_str(), run.value, run.error,
                        run.seconds);
        EXPECT_TRUE(o.passed()) << o.name << ": error " << o.last().error << ", tolerance "
                                << o.tolerance << "; order " << o.observed_order() << ", expected "
                                << o.expected_order;
    }
}

INSTANTIATE_TEST_SUITE_P(All, Verification, testing::ValuesIn(test_cases()), [](const auto& info) {
    std::string name;
    for (const char c : cases()[info.param].name)
        if (std::isalnum(static_cast<unsigned char>(c))) name += c;
    return name;
});

}  // namespace
}  // namespace livetet::verification
