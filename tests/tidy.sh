#!/usr/bin/env bash
# clang-tidy with the checks of .clang-tidy on src, solvers and io, or on the files named:
#     tests/tidy.sh [FILE ...]
# Needs the Debian package clang-tidy-14. It takes a quarter of an hour on two cores, so CI does not run it: run it before a
# release, and on the files that you change.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LIVETET_BUILD:-$root/build}-tidy
cd "$root"
# One command a file: no units of many files, no precompiled headers of another compiler.
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON \
    -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DLIVETET_NATIVE=OFF >/dev/null
files=("$@")
# ITK 5.2's headers refuse clang 14.
((${#files[@]})) || mapfile -t files < <(find src solvers io -name '*.cpp' ! -name itk_volume.cpp | sort)
printf '%s\0' "${files[@]}" | xargs -0 -P "$(nproc)" -n 4 clang-tidy-14 -p "$build" --quiet
