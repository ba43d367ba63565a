#!/usr/bin/env bash
# Tests workers with a broker and an S3 server on one machine. Kills a worker and the broker, and makes the server unreachable. Every photo
# must still be converted exactly once, and every broken photo must become a dead letter with a reason. Also tests storage in a folder,
# messages that kill workers, metrics, and Slurm. Ends with "N passed, N failed".
#
#   PHOTOS=60 tests/service/run.sh     number of photos, 500 by default; 4 % of them are broken
#
# PROGRAMS is the folder with photo3d, photo3d_worker and photo3d_queue. If it is unset, the script builds them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/requirements.sh
source scripts/requirements.sh
# shellcheck source=scripts/tally.sh
source scripts/tally.sh
# shellcheck source=examples/service/broker.sh
source examples/service/broker.sh
# shellcheck source=tests/service/s3_server.sh
source tests/service/s3_server.sh

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_service[@]}" "${needs_service_tests[@]}"
install_npm_packages tests/service
if [ -z "${PROGRAMS:-}" ]; then
    cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF
    cmake --build --preset release --target photo3d photo3d_worker photo3d_queue
    PROGRAMS=build/release/examples
fi
export PROGRAMS

number=${PHOTOS:-500}
work=$(mktemp -d)
clean_up() {
    [ -z "${KEEP:-}" ] || cp -r "$work" "$KEEP"
    local process
    # Waits for each killed process. Otherwise, the shell would report the process after the last line.
    for process in "${!workers[@]}" "${collector:-}"; do
        [ -z "$process" ] || { kill -KILL "$process" && wait "$process"; } 2>/dev/null || true
    done
    remove_broker
    remove_s3
    rm -rf "$work"
}
trap clean_up EXIT
declare -A workers=() # log and address of each running worker, by process

documents() { /usr/bin/python3 tests/service/documents.py "$@"; }
lines_of() { cat "$@" 2>/dev/null | wc -l; }

# start_worker NAME QUEUE PHOTOS OUTPUTS [OPTION...]: sets worker (its process), worker_log and worker_address.
start_worker() {
    local port
    read -r port <<<"$(free_ports 1)"
    worker_log=$work/$1.log
    worker_address=http://127.0.0.1:$port
    (
        ulimit -Sf "${kilobytes_of_file:-unlimited}"
        exec "$PROGRAMS/photo3d_worker" --broker "$broker_url" --queue "$2" --photos "$3" --outputs "$4" --http "127.0.0.1:$port" \
            "${@:5}"
    ) >>"$worker_log" 2>>"$work/errors" &
    worker=$!
    workers[$worker]=$worker_log
}

# stop_worker SIGNAL PROCESS: sends the signal and waits until the worker ends.
stop_worker() {
    kill "-$1" "$2" 2>/dev/null || true
    wait "$2" 2>/dev/null || true
    unset "workers[$2]"
}

# wait_until SECONDS COMMAND...: repeats the command until it succeeds; fails after SECONDS.
wait_until() {
    local until=$((SECONDS + $1))
    shift
    until "$@"; do
        [ "$SECONDS" -lt "$until" ] || return 1
        sleep 0.1
    done
}

queue() { "$PROGRAMS/photo3d_queue" --broker "$broker_url" --queue "$1" "${@:2}"; }
health() { curl -s -o /dev/null -w '%{http_code}' "$1/health" || true; }
health_is() { [ "$(health "$1")" = "$2" ]; }

PYTHONPATH=tests/program count_script /usr/bin/python3 tests/service/options.py "$PROGRAMS/photo3d_worker" "$PROGRAMS/photo3d_queue"
source tests/service/failures.sh
source tests/service/folder.sh
source tests/service/systemd.sh
count_step "examples/service/run.sh converts the sample" examples/service/run.sh
count_script tests/service/slurm.sh
print_tally
