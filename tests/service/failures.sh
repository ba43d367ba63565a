# Part of tests/service/run.sh: converts photos in a bucket. Meanwhile it kills a worker, kills the broker, and cuts the network to the
# storage.

# shellcheck shell=bash disable=SC2154

# Creates the photos, the broken files, and the list of uploads. Photos are photographs if present, or else crops of the sample.
make_photos() {
    local from=../shared/photos/train broken=$((number < 125 ? 5 : number / 25)) made
    made=$((number - broken))
    mkdir -p "$work/photos"
    if [ -d "$from" ] && [ "$(find "$from" -name '*.jpg' | wc -l)" -ge "$made" ]; then
        find "$from" -name '*.jpg' | sort | awk -v made="$made" 'NR <= made' | xargs cp -t "$work/photos"
    else
        printf 'fewer than %d photographs in %s: using crops of the sample\n' "$made" "$from"
        ffmpeg -loglevel error -loop 1 -i examples/photo3d/sample.jpg -frames:v "$made" \
            -vf "crop=384:384:x='mod(n*97,in_w-384)':y='mod(n*61,in_h-384)'" -q:v 3 "$work/photos/%03d.jpg"
    fi
    find "$work/photos" -type f -printf '%p\talbum, ü + 1/%f\n' | sort >"$work/uploads"

    head -c 5000 /dev/urandom >"$work/noise"
    one_photo=$(find "$work/photos" -type f -print -quit)
    head -c 300 "$one_photo" >"$work/cut"
    : >"$work/empty"
    python3 -c 'import struct, sys, zlib
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
header = struct.pack(">IIBBBBB", 30_000, 30_000, 8, 2, 0, 0, 0)
sys.stdout.buffer.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", bytes(4_000_000)) + chunk(b"IEND", b""))' >"$work/huge"
    local kinds=("noise	unsupported" "cut	invalid data" "empty	invalid data" "huge	too large" "	file access") i kind file
    for ((i = 0; i < broken; ++i)); do
        kind=${kinds[i % ${#kinds[@]}]} file=${kind%%	*}
        printf 'broken/%d.jpg\t%s\n' "$i" "${kind#*	}" >>"$work/broken"
        [ -z "$file" ] || printf '%s\tbroken/%d.jpg\n' "$work/$file" "$i" >>"$work/uploads" # without a file, the photo is missing
    done
    { cut -f 2 "$work/uploads" && cut -f 1 "$work/broken"; } | sort -u | shuf --random-source=examples/photo3d/sample.jpg >"$work/keys"
}

are_done() { [ "$(lines_of "$work/results" "$work/dead")" -ge "$1" ]; }

# kill_in_mid_message PROCESS LOG: suspends the worker. If the worker is not processing a message, resumes it and fails.
kill_in_mid_message() {
    kill -STOP "$1"
    documents in_mid_message "$2" && return
    kill -CONT "$1"
    return 1
}

# Compares the GLB files in the bucket with those of photo3d --batch, byte by byte.
are_same_bytes() {
    cut -f 1 "$work/uploads" | grep "^$work/photos/" | python3 -c 'import json, os, sys
for line in sys.stdin:
    print(json.dumps({"photo": line.strip(), "output": sys.argv[1] + "/" + os.path.basename(line.strip()) + ".glb"}))' "$work/expected" \
        >"$work/list.jsonl"
    mkdir -p "$work/expected" "$work/found"
    "$PROGRAMS/photo3d" --batch "$work/list.jsonl" --quiet >/dev/null
    grep "^$work/photos/" "$work/uploads" | while IFS=$'\t' read -r file key; do
        printf '%s\t%s\n' "$work/found/$(basename "$file").glb" "out/$key.glb"
    done >"$work/downloads"
    s3_get "$work/downloads" && diff -r "$work/expected" "$work/found"
}

make_photos
mkdir "$work/s3"
start_s3 "$work/s3" photos
s3_put "$work/uploads"
start_broker "$work/broker"
printf '\n== %d photos, %d of them broken; to cut off the storage: %s\n' "$number" "$(lines_of "$work/broken")" "$s3_cut"

start_worker one photos s3://photos s3://photos/out
first=$worker first_log=$worker_log
start_worker two photos s3://photos s3://photos/out
second_log=$worker_log second_address=$worker_address
queue photos submit --photos-per-message 8 <"$work/keys"
queue photos collect --results "$work/results" --dead "$work/dead" --expected "$number" >"$work/collected" &
collector=$!

wait_until 120 are_done $((number / 6))
count_step "a worker can be killed while it processes a message" wait_until 60 kill_in_mid_message "$first" "$first_log"
stop_worker KILL "$first"
start_worker three photos s3://photos s3://photos/out
third_log=$worker_log third_address=$worker_address

wait_until 120 are_done $((number * 2 / 6))
kill -KILL "$broker_process"
wait "$broker_process" 2>/dev/null || true
count_step "while the broker is down, a worker reports that it is unhealthy" wait_until 20 health_is "$third_address" 503
start_broker "$work/broker"
count_step "after the broker has restarted, the worker reports that it is healthy" wait_until 60 health_is "$third_address" 200

wait_until 120 are_done $((number * 3 / 6))
cut_network
is_one_without_storage() { health_is "$second_address" 503 || health_is "$third_address" 503; } # an idle worker does not notice
count_step "while the storage is unreachable, a worker reports that it is unhealthy" wait_until 60 is_one_without_storage
mend_network

has_ended() { ! kill -0 "$1" 2>/dev/null; }
is_collected() { wait_until 600 has_ended "$collector" && wait "$collector"; }
count_step "the collector receives all documents and ends" is_collected
collector=
cat "$work/collected"
count_step "every photo has exactly one result or dead letter" documents each_once "$work/keys" "$work/results" "$work/dead"
count_step "the dead letters are exactly the broken photos, with the right error codes" documents reasons "$work/dead" "$work/broken"
count_step "the broker delivers the message of the killed worker again" documents some_came_again "$second_log" "$third_log"
count_step "the GLB files have the same bytes as those of photo3d --batch" are_same_bytes
count_step "a worker logs failed access to the storage" grep -q '"storage failed"' "$second_log" "$third_log"
count_step "every line of the logs has time, level, event and process" documents logs_are_structured "$first_log" "$second_log" "$third_log"
for process in "${!workers[@]}"; do stop_worker TERM "$process"; done
