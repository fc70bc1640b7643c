#!/usr/bin/env bash
# Compares with CalculiX (Debian's calculix-ccx) on the same meshes: linear and Green's strain, P1 and P2.
set -euo pipefail
command -v ccx >/dev/null || { echo "CalculiX is not there: apt-get install calculix-ccx" >&2; exit 2; }
build=${LIVETET_BUILD:-$(cd "$(dirname "$0")/.." && pwd)/build}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMP_NUM_THREADS=1
"$build/benchmarks/bench_calculix" "$folder"
