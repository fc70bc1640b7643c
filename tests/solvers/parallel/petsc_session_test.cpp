#include "solvers/parallel/petsc_session.hpp"

#include <gtest/gtest.h>

#include <csignal>

#include "base/error.hpp"

namespace livetet {
namespace {

TEST(PetscSession, IsOneAProgram) {
    EXPECT_THROW(PetscSession("second", {}), Error);
    EXPECT_THROW(PetscSession("third", {"-ksp_view"}), Error) << "the second has ended the first";
    EXPECT_FALSE(PetscSession::any_options()) << "options of a session that there is not";
}

/// PETSc's own handlers would take, among many, signals that MPI leaves alone.
TEST(PetscSession, LeavesSignalsToTheProgram) {
    for (const int signal : {SIGILL, SIGSYS, SIGHUP, SIGTERM, SIGPIPE, SIGURG}) {
        struct sigaction now = {};
        ASSERT_EQ(::sigaction(signal, nullptr, &now), 0);
        EXPECT_TRUE(now.sa_handler == SIG_DFL || now.sa_handler == SIG_IGN) << signal;
    }
}

}  // namespace
}  // namespace livetet
