#!/usr/bin/env bash
# Searches for a depth network: measures the latency table, trains members briefly, fits the predictor, searches, trains the resulting
# networks just as briefly, and checks the paper's own network against its published results. Installs missing packages. Skips steps whose
# data is missing and prints the reason.
#
#   search/run.sh [--quick] [OPTION_OF_members.py...]     --quick: a smoke test, results in build/search_quick
#
# Without --quick, writes the results (latency.json, members.json, result.json, pareto.png) to this folder. If members.json exists, trains
# only members that it lacks, and adds their results. Reads photos/train, rgbd_train, rgbd_train_more and tiefenrausch in the folder SHARED
# (default: ../shared beside the repository).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_compiler[@]}" "${needs_training[@]}" "${needs_weight_files[@]}" >&2
shared=${SHARED:-$root/../shared}
results=$here built=$root/build/search rounds=5 generations=60 photos=2 quick=
if [ "${1:-}" = --quick ]; then
    shift
    quick=1 built=$root/build/search_quick rounds=1 generations=3 photos=1
    results=$built
    set -- --count 24 --members 4 --steps 2 "$@"
fi
mkdir -p "$built"
# Without the two MALLOC settings, the C library returns the memory of every large tensor to the system, which takes time.
export MALLOC_TRIM_THRESHOLD_=8000000000 MALLOC_MMAP_THRESHOLD_=8000000000 PYTHONDONTWRITEBYTECODE=1
recipe=$here/../tiefenrausch_small

compile() { "${CXX:-g++}" -std=c++20 -O2 -I"$root/include" "$1.cpp" -o "$built/$(basename "$1")"; }
python() { nice -n 19 /usr/bin/python3 "$@"; }
is_there() { [ -e "$1" ] || { printf 'skipped %s: there is no %s\n' "$2" "$1" && false; }; }

compile "$here/latency"
members=$results/members.json
search() { python "$here/search.py" --latency "$built/latency" --members "$members" --out "$results" --rounds "$rounds" \
    --generations "$generations" "$@"; }
train() { python "$here/members.py" --photos "$shared/photos/train" --estimate "$built/estimate" --out "$built" --results "$members" \
    --teacher "$root/examples/models/tiefenrausch_small.safetensors" "${depth[@]}" "$@"; }

trainable=
if is_there "$shared/photos/train" "the training runs; the predictor reads the results beside this script"; then
    trainable=1
    compile "$recipe/estimate"
    depth=()
    for folder in rgbd_train rgbd_train_more; do
        [ -n "$quick" ] || ! is_there "$shared/$folder" "its measured depth" || depth+=(--depth "$shared/$folder")
    done
    train "$@"
else
    members=$here/members.json
fi
search --measure
if [ -n "$trainable" ] && [ -z "$quick" ]; then
    train "$@" --also "$results/result.json"
    search
fi

if is_there "$shared/tiefenrausch/model" "the check of the paper's network"; then
    compile "$recipe/convert"
    "$built/convert" "$shared/tiefenrausch/model" "$built/published.safetensors"
    checked=()
    [ -z "$trainable" ] || checked=(--check-training "$built/labels" --steps $((10 * photos)))
    python "$recipe/tr_unet.py" --published "$built/published.safetensors" --golden "$shared/tiefenrausch/golden" --photos "$photos" "${checked[@]}"
fi
