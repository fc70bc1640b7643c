#!/usr/bin/env bash
# All tests. Real inputs are used where LIVETET_DATA names their folder; tests that want them skip, saying so, without.
source "$(dirname "$0")/../apps/setup.sh" -DBUILD_TESTING=ON -DLIVETET_BENCHMARKS=ON

say "the variant without VTK, ITK and CGAL, for machines that only solve"
cmake -S "$root" -B "$build-lean" -G Ninja -DCMAKE_BUILD_TYPE=Release -DLIVETET_IMAGES=OFF -DLIVETET_BENCHMARKS=OFF \
    -DBUILD_TESTING=OFF -DCMAKE_CXX_FLAGS_RELEASE="-O0 -DNDEBUG" >/dev/null  # it is built, not measured
cmake --build "$build-lean"
"$build-lean/apps/livetet" scene >/dev/null
if ldd "$build-lean/apps/livetet" | grep -qE 'libvtk|libITK'; then
    echo "the variant without images links VTK or ITK" >&2
    exit 1
fi

say "testing"
[ -n "${LIVETET_DATA:-}" ] || echo "LIVETET_DATA is not set: tests on real inputs will be skipped"
ctest --test-dir "$build" -j 2 --output-on-failure
