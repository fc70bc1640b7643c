#!/usr/bin/env bash
# All tests, then the benchmarks' commands at a small size. Real inputs are used where LIVETET_DATA names their folder; tests that want them skip, saying so, without.
preset=ci
source "$(dirname "$0")/../apps/setup.sh"

say "unit tests under the address and undefined behaviour sanitizers, configured without VTK, ITK, GDCM and CGAL"
cmake -S "$root" -B "$build-dev" --preset dev -DLIVETET_IMAGES=OFF -DLIVETET_BENCHMARKS=OFF >/dev/null
cmake --build "$build-dev" --target tests_src tests_io_openigtlink
ctest --test-dir "$build-dev" --output-on-failure -R '^(src|io_openigtlink)$'

say "the variant without VTK, ITK, GDCM and CGAL, for machines that only solve"
cmake --build "$build" --target livetet_lean
lean=$build/libexec/livetet/livetet-lean
"$lean" scene >/dev/null
if ldd "$lean" | grep -qE 'libvtk|libITK|libgdcm|libgmsh'; then
    echo "the variant without images links VTK, ITK, GDCM or Gmsh" >&2
    exit 1
fi

say "the solvers with PETSc's 64-bit indices, on two ranks"
cmake -S "$root" -B "$build-wide" --preset ci -DLIVETET_PETSC=PETSc64 -DLIVETET_IMAGES=OFF -DLIVETET_BENCHMARKS=OFF >/dev/null
cmake --build "$build-wide" --target tests_solvers
mpirun --oversubscribe -n 2 "$build-wide/tests/tests_solvers" --gtest_brief=1

say "testing"
[ -n "${LIVETET_DATA:-}" ] || echo "LIVETET_DATA is not set: tests on real inputs will be skipped"
export GTEST_BRIEF=1  # what fails, and no more
status=0
ctest --test-dir "$build" -j 2 --output-on-failure --label-exclude clock || status=$?
ctest --test-dir "$build" -j 2 --output-on-failure --label-regex clock --repeat until-pass:2 || status=$?

say "the benchmarks' commands, at a size that says only that they work"
LIVETET_OUT=$build/benchmarks/quick "$root/benchmarks/run.sh" --quick || status=$?
exit $status
