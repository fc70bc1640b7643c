#include <gtest/gtest.h>

#include "support/program.hpp"

namespace livetet::test {
namespace {

TEST(StartUp, DoesNotWaitForGmsh) {
    const Folder folder;
    const Outcome libraries = run(folder, "ldd '" LIVETET_PROGRAM "'");
    ASSERT_EQ(libraries.status, 0) << libraries.err;
    EXPECT_NE(libraries.out.find("libpetsc"), std::string::npos) << libraries.out;
    EXPECT_EQ(libraries.out.find("libgmsh"), std::string::npos);
    EXPECT_EQ(libraries.out.find("libTK"), std::string::npos) << "OpenCASCADE";
}

}  // namespace
}  // namespace livetet::test
