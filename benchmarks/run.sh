#!/usr/bin/env bash
# Measures, and writes a report: machine, compiler, commit, what each command printed, figures.
#     benchmarks/run.sh [--quick | --report] [PART ...]
# Parts: verification convergence stability savings workprecision realtime latency view warp accuracy registration scaling kernels; all
# where none is named. Results and report.md go to benchmarks/out.
#     --report   the report and its figures are put into docs/reports/DATE, too (DATEb, DATEc where that is there)
#     --quick    the same commands at a size that shows only that they work
all=(verification convergence stability savings workprecision realtime latency view warp accuracy registration scaling kernels)
quick=false
report=false
parts=()
for word in "$@"; do
    case " ${all[*]} " in *" $word "*) parts+=("$word"); continue ;; esac
    case $word in
    --quick) quick=true ;;
    --report) report=true ;;
    *) echo "benchmarks/run.sh: found $word, expected --quick, --report or a part: ${all[*]}" >&2; exit 2 ;;
    esac
done
if $quick && $report; then echo "benchmarks/run.sh: found --quick and --report, expected one of them" >&2; exit 2; fi
today=$(date -u +%F)
source "$(dirname "$0")/../apps/setup.sh" -DLIVETET_BENCHMARKS=ON
((${#parts[@]})) || parts=("${all[@]}")
out=${LIVETET_OUT:-$root/benchmarks/out}
mkdir -p "$out"
out=$(cd "$out" && pwd)
cp -r "$root/benchmarks/scenes" "$out/"
figures=()  # of all parts, in report.md

full() { if $quick; then printf '%s' "$2"; else printf '%s' "$1"; fi; }
missed=()
# describe NAME COMMAND FIGURE...: a section of the report, of what a command printed and drew.
describe() {
    local name=$1 command=$2 text figure
    shift 2
    text=$(<"$out/$name.txt")
    {
        printf '\n## %s\n\n`%s`\n\n```text\n%s\n```\n' "$name" "${command//$out\//}" "${text//$out\//}"
        for figure in "$@"; do printf '\n![%s](%s)\n' "$(basename "$figure" .png)" "$(basename "$figure")"; done
    } >>"$out/report.md"
    figures+=("$@")
}
# measure NAME ARGUMENTS...: prints, keeps and describes what `livetet bench` says; 1 is a target missed, told at the end.
measure() {
    local name=$1 status=0 argument drawn=()
    shift
    for argument in "$@"; do [[ $argument == *.png ]] && drawn+=("$argument"); done
    say "$name: livetet bench $*"
    "$livetet" bench "$@" | tee "$out/$name.txt" || status=$?
    if ((status == 1)); then
        missed+=("$name")
    elif ((status)); then
        echo "benchmarks/run.sh: $name ended with status $status" >&2
        exit "$status"
    fi
    describe "$name" "livetet bench $*" ${drawn[@]+"${drawn[@]}"}
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
printf '# Measurements, %s\n\n```text\n%s\n```\n' "$today" "$(<"$out/machine.txt")" >"$out/report.md"

verification() { measure verification verification $(full '' '--only patch') --csv "$out/verification.csv" $(full "--figure $out/verification.png" ''); }
convergence() { measure convergence convergence $(full '' '--max-nodes 1100 --only nodes') --csv "$out/convergence.csv" --figure "$out/convergence.png"; }
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
        if [ "$name" = phantom_static ]; then repeats=3; fi  # all of them would take an hour
        measure "workprecision_$name" workprecision "$out/scenes/$name.yaml" --repeats $repeats $(full '' '--only level') --csv "$out/workprecision_$name.csv" \
            --figure "$out/workprecision_$name.png" --memory-figure "$out/memory_$name.png"
    done
}
realtime() { measure realtime realtime $(full "--figure $out/realtime.png" '--size P60 --frames 20') --json "$out/realtime.json"; }
latency() { measure latency latency $(full '' '--for 3 --tets 3000') --json "$out/latency.json"; }
view() { measure view view $(full '' '--for 1 --stretches 1 --tets 3000') --json "$out/view.json"; }
warp() { measure warp warp $(full '' '--size 64 --tets 3000 --repeats 1') --json "$out/warp.json"; }
accuracy() {
    measure accuracy accuracy $(full '--seeds 8 --other-seeds 5 --bodies 10 --body-seeds 4 --limit-seeds 4' '--seeds 1 --other-seeds 1 --bodies 1 --body-seeds 1 --limit-seeds 1 --sensors 2 --tets 800 --truth-tets 600') --csv "$out/accuracy.csv" \
        --figure "$out/accuracy.png" --calibration "$out/calibration.png"
}
registration() {
    measure registration registration $(full '' '--quick --seeds 1 --tets 2000 --truth-tets 2000') --json "$out/registration.json" \
        $(full "--figure $out/registration.png" '')
}
scaling() {
    measure scaling scaling $(full "--figure $out/scaling.png" '--unknowns 20000 --ranks 1,2') --json "$out/scaling.json"
}
kernels() {
    local name
    for name in kernels batch_kernels; do
        say "$name"
        "$build/benchmarks/bench_$name" --benchmark_min_time=$(full 0.2 0.01) --benchmark_repetitions=$(full 3 1) | tee "$out/$name.txt"
        describe "$name" "build/benchmarks/bench_$name"
    done
}

start=$SECONDS
for part in "${parts[@]}"; do
    began=$SECONDS
    "$part"
    echo "$part took $((SECONDS - began)) s"
done
say "$((SECONDS - start)) s in all; results are in $out"
if ((${#missed[@]})); then
    echo "targets were missed in: ${missed[*]}"
    printf '\nTargets were missed in: %s.\n' "${missed[*]}" >>"$out/report.md"
fi
if $report; then
    place=$root/docs/reports/$today
    for letter in b c d e f g h; do [ ! -e "$place" ] || place=$root/docs/reports/$today$letter; done  # not the first today
    mkdir "$place"
    cp "$out/report.md" ${figures[@]+"${figures[@]}"} "$place/"
    say "the report is in $place; add it to docs/reports/README.md"
fi
