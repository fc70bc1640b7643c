#!/usr/bin/env bash
# Installs the Debian packages of apps/packages.txt that are missing (sudo only if not root), configures and builds.
# Sourced with options for CMake by apps/demo.sh and tests/run.sh, which may set $preset; afterwards $livetet is the program and
# $build the build folder.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LIVETET_BUILD:-$root/build}
livetet=$build/apps/livetet

say() { printf '\n\033[1m== %s\033[0m\n' "$*"; }

missing=()
while read -r package; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done < <(grep -v '^#' "$root/apps/packages.txt")
if ((${#missing[@]})); then
    say "installing ${#missing[@]} packages: ${missing[*]}"
    as_root=()
    [ "$(id -u)" = 0 ] || as_root=(sudo)
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >"$root/.packages.log" 2>&1 ||
        { tail -n 20 "$root/.packages.log"; echo "apt-get could not install the packages above" >&2; exit 1; }
    rm -f "$root/.packages.log"
fi

say "building in $build"
cmake -S "$root" -B "$build" --preset "${preset:-release}" "$@" >"$build.log" 2>&1 || { cat "$build.log"; exit 1; }
rm -f "$build.log"
cmake --build "$build"

# Open MPI asks a root user twice; a BLAS with threads of its own would only disturb.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OPENBLAS_NUM_THREADS=1
