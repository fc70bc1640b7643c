#include <gtest/gtest.h>

#include "solvers/parallel/petsc_session.hpp"

/// The same tests run on one rank and on several; only rank 0 reports, every rank's failures count.
int main(int argc, char** argv) {
    ::testing::InitGoogleTest(&argc, argv);
    livetet::PetscSession session("tests_solvers", {});
    if (session.rank() != 0)
        delete ::testing::UnitTest::GetInstance()->listeners().Release(
            ::testing::UnitTest::GetInstance()->listeners().default_result_printer());
    return RUN_ALL_TESTS();
}
