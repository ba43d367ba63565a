#!/usr/bin/env bash
# Measures how much faster two workers of examples/service convert photos than one worker (medians of three alternating runs), and how many
# messages per second the broker accepts. Everything runs on one machine, in temporary folders. The storage is a folder, because a storage
# server would compete for the same cores.
#
#   bench/service/run.sh [NUMBER_OF_PHOTOS [FOLDER]]     200 of ../shared/photos/train, else copies of the sample
#
# PROGRAMS is the folder with photo3d_worker and photo3d_queue. If it is unset, the script builds them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=examples/service/broker.sh
source examples/service/broker.sh
# shellcheck source=bench/support/photos.sh
source bench/support/photos.sh

number=${1:-200}
from=$(photos_for "$number" "${2:-}")
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_service[@]}" >&2
if [ -z "${PROGRAMS:-}" ]; then
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF >&2
    cmake --build --preset release --target photo3d_worker photo3d_queue >&2
    PROGRAMS=build/release/examples
fi

work=$(mktemp -d)
workers=()
clean_up() {
    [ "${#workers[@]}" = 0 ] || kill "${workers[@]}" 2>/dev/null || true
    remove_broker
    rm -rf "$work"
}
trap clean_up EXIT

# run WORKERS NAME PHOTOS_PER_MESSAGE JOB: prints photos per second, from the workers' start to the last document on the disk.
run() {
    local queue=("$PROGRAMS/photo3d_queue" --broker "$broker_url" --queue "$2")
    "${queue[@]}" submit --job "$4" --photos-per-message "$3" <"$work/keys" >/dev/null
    mkdir -p "$work/$4"
    workers=()
    for _ in $(seq "$1"); do
        "$PROGRAMS/photo3d_worker" --broker "$broker_url" --queue "$2" --photos "$from" --outputs "$work/$4" >"$work/log" &
        workers+=($!)
    done
    "${queue[@]}" collect --results "$work/$2.results" --dead "$work/$2.dead" --expected "$number" |
        python3 -c 'import json, sys; line = json.load(sys.stdin); print(line["results"] / line["seconds"])'
    kill "${workers[@]}"
    wait "${workers[@]}" || true
    workers=()
}

start_broker "$work/broker"
(cd "$from" && find . -name '*.jpg' -printf '%P\n') | sort | awk -v number="$number" 'NR <= number' >"$work/keys"
for round in 1 2 3; do
    for count in 1 2; do run "$count" "q$count$round" 8 "j$count$round" >>"$work/rates$count"; done
done
run 1 again 1 j11 >"$work/rate_done" # repeats the first job: the worker finds its documents and publishes them
seq 50000 | "$PROGRAMS/photo3d_queue" --broker "$broker_url" --queue many submit --photos-per-message 1 >"$work/many"
python3 - "$work" "$number" "$(nproc)" <<'SUMMARY'
import json, statistics, sys
work, number, cores = sys.argv[1:]
rates = {n: [float(x) for x in open(f"{work}/rates{n}")] for n in (1, 2)}
one, two = (statistics.median(rates[n]) for n in (1, 2))
documents = [json.loads(line) for line in open(f"{work}/q11.results")]
mean = lambda key: sum(d[key] for d in documents) / len(documents)
many = json.load(open(f"{work}/many"))
print(f"{number} photographs of {sum(d['width'] * d['height'] for d in documents) / len(documents) / 1e6:.2f} megapixels, {cores} cores, GLB files of {mean('bytes') / 1000:.0f} kB, "
      f"{mean('milliseconds'):.0f} ms each with one worker")
print(f"photographs per second: one worker {one:.2f}, two {two:.2f}; ratio in each round:", " ".join(f"{b / a:.2f}" for a, b in zip(rates[1], rates[2])))
print(f"messages with one photo that is already converted: {float(open(work + '/rate_done').read()):.0f} per second by one worker")
print(f"messages sent and confirmed: {many['messages'] / many['seconds']:.0f} per second")
print(f"two workers are {two / one:.2f} times as fast as one (goal: 1.8)")
SUMMARY
