#!/usr/bin/env bash
# All tests. Real inputs are used where LIVETET_DATA names their folder; tests that want them skip, saying so, without.
source "$(dirname "$0")/../apps/setup.sh"
say "testing"
[ -n "${LIVETET_DATA:-}" ] || echo "LIVETET_DATA is not set: tests on real inputs will be skipped"
ctest --test-dir "$build" --output-on-failure
