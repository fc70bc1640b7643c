#include "base/shared_library.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"

namespace livetet {
namespace {

std::string error_of_library(const std::function<void()>& f) {
    try {
        f();
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

TEST(SharedLibrary, GivesItsFunctions) {
    const SharedLibrary math("mathematics", "libm.so.6");
    EXPECT_DOUBLE_EQ(math.function<double(double)>("cbrt")(27), 3);
}

TEST(SharedLibrary, AMissingLibraryIsAnErrorWithItsNameAndTheReason) {
    const std::string text = error_of_library([] { SharedLibrary("Gmsh", "libof_nobody.so.4.8"); });
    for (const char* words : {"Gmsh: ", "expected libof_nobody.so.4.8", "No such file"})
        EXPECT_NE(text.find(words), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

TEST(SharedLibrary, AMissingFunctionIsAnErrorWithItsName) {
    const SharedLibrary math("mathematics", "libm.so.6");
    const std::string text = error_of_library([&] { math.function<void()>("gmshOf2050"); });
    for (const char* words : {"mathematics: ", "no function gmshOf2050"})
        EXPECT_NE(text.find(words), std::string::npos) << text;
}

}  // namespace
}  // namespace livetet
