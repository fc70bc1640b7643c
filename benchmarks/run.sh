#!/usr/bin/env bash
# Measures what the README's figures show, and writes down on what machine.
#     benchmarks/run.sh [--quick] [PART ...]
# Parts: verification convergence stability savings workprecision realtime latency accuracy scaling kernels; all where none is
# named. Results go to benchmarks/out. --quick: the same commands at a size that says only that they work.
quick=false
parts=()
for word in "$@"; do
    case $word in
    --quick) quick=true ;;
    verification | convergence | stability | savings | workprecision | realtime | latency | accuracy | scaling | kernels) parts+=("$word") ;;
    *) echo "benchmarks/run.sh: found $word, expected --quick or a part: $(sed -n 's/^# Parts: //p' "$0")" >&2; exit 2 ;;
    esac
done
source "$(dirname "$0")/../apps/setup.sh" -DLIVETET_BENCHMARKS=ON
((${#parts[@]})) || parts=(verification convergence stability savings workprecision realtime latency accuracy scaling kernels)
out=${LIVETET_OUT:-$root/benchmarks/out}
mkdir -p "$out"
out=$(cd "$out" && pwd)
cp -r "$root/benchmarks/scenes" "$out/"

full() { if $quick; then printf '%s' "$2"; else printf '%s' "$1"; fi; }
missed=()
# measure NAME ARGUMENTS...: prints and keeps what `livetet bench` says; 1 is a target missed, told at the end.
measure() {
    local name=$1 status=0
    shift
    say "$name: livetet bench $*"
    "$livetet" bench "$@" | tee "$out/$name.txt" || status=$?
    if ((status == 1)); then
        missed+=("$name")
    elif ((status)); then
        echo "benchmarks/run.sh: $name ended with status $status" >&2
        exit "$status"
    fi
}

{
    date -u +'%Y-%m-%d %H:%M UTC'
    echo "commit    $(git -C "$root" rev-parse HEAD 2>/dev/null || echo unknown)$(git -C "$root" diff --quiet HEAD 2>/dev/null || echo ', changed since')"
    echo "options   $(full full quick): ${parts[*]}"
    echo "machine   $(sed -n 's/^model name\s*: //p' /proc/cpuinfo | head -n 1), $(nproc) cores, $(awk '/MemTotal/ {printf "%.0f GiB", $2 / 1048576}' /proc/meminfo)"
    echo "compiler  $("${CXX:-c++}" --version | head -n 1)"
    grep -v '^#' "$root/apps/packages.txt" | xargs dpkg-query -W -f 'package   ${Package} ${Version}\n' 2>/dev/null
} >"$out/machine.txt"
head -n 5 "$out/machine.txt"

verification() { measure verification verification $(full '' '--only patch') --csv "$out/verification.csv" $(full "--figure $out/verification.png" ''); }
convergence() { measure convergence convergence $(full '' '--most-nodes 1100 --only nodes') --csv "$out/convergence.csv" --figure "$out/convergence.png"; }
stability() { measure stability stability --cells 2 --budget 50 $(full '--noise-frames 10000' '--noise-frames 1000 --only step') --csv "$out/stability.csv" --figure "$out/stability.png"; }
savings() { measure savings savings "$out/scenes/$(full linear layers).yaml" $(full '' '--repeats 1') --json "$out/savings.json"; }
workprecision() {
    local names=(phantom_static phantom_newmark cantilever column block layers everything)
    if $quick; then names=(layers); fi
    if ! $quick && [ ! -f "$out/scenes/liver_small.h5" ]; then
        "$livetet" phantom -o "$out/phantom" >"$out/phantom.log"
        local mesh=("$livetet" mesh "$out/phantom/labels.nii.gz" --fix "$out/phantom/fixed_mask.nii.gz" --levels 2)
        "${mesh[@]}" --tets 12000 -o "$out/scenes/liver.h5" >"$out/mesh.log"
        "${mesh[@]}" --tets 4000 -o "$out/scenes/liver_small.h5" >>"$out/mesh.log"  # for a dynamic run on ten-node tets in quarter steps
    fi
    local name repeats
    for name in "${names[@]}"; do
        repeats=1
        if [ "$name" = phantom_static ]; then repeats=3; fi  # whose figure the README shows; more would take the hour
        measure "workprecision_$name" workprecision "$out/scenes/$name.yaml" --repeats $repeats $(full '' '--only level') --csv "$out/workprecision_$name.csv" \
            --figure "$out/workprecision_$name.png" --memory-figure "$out/memory_$name.png"
    done
}
realtime() { measure realtime realtime $(full '--frames 150' '--size P60 --frames 20') --json "$out/realtime.json"; }
latency() { measure latency latency $(full '' '--for 3 --tets 3000') --json "$out/latency.json"; }
accuracy() { measure accuracy accuracy $(full '--seeds 4' '--seeds 1 --tets 1500 --truth-tets 1500') --csv "$out/accuracy.csv" --figure "$out/accuracy.png"; }
scaling() { measure scaling scaling $(full '--ranks 1,2 --compare gamg' '--unknowns 20000 --ranks 1,2') --json "$out/scaling.json"; }
kernels() {
    local name
    for name in kernels batch_kernels; do
        say "$name"
        "$build/benchmarks/bench_$name" --benchmark_min_time=$(full 0.2 0.01) --benchmark_repetitions=$(full 3 1) | tee "$out/$name.txt"
    done
}

start=$SECONDS
for part in "${parts[@]}"; do
    began=$SECONDS
    "$part"
    echo "$part took $((SECONDS - began)) s"
done
say "$((SECONDS - start)) s in all; results are in $out"
if ((${#missed[@]})); then echo "targets were missed in: ${missed[*]}"; fi
