#!/usr/bin/env bash
# Starts a broker and two workers on this machine, submits and converts photos, and prints the results. Needs no containers.
#
#   examples/service/run.sh [FOLDER_OF_PHOTOS [FOLDER_FOR_OUTPUTS]]     default: four copies of the sample and a broken file;
#                                                                       build/service/outputs
#
# PROGRAMS is the folder with photo3d_worker and photo3d_queue. If it is unset, the script builds them.
set -euo pipefail
repository=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../..")
# shellcheck source=scripts/requirements.sh
source "$repository/scripts/requirements.sh"
# shellcheck source=examples/service/broker.sh
source "$repository/examples/service/broker.sh"

work=$(mktemp -d)
processes=()
clean_up() {
    [ "${#processes[@]}" = 0 ] || kill "${processes[@]}" 2>/dev/null || true
    remove_broker
    rm -rf "$work"
}
trap clean_up EXIT

require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_service[@]}"
outputs=$(realpath -m "${2:-$repository/build/service/outputs}")
mkdir -p "$outputs" "$work/photos"
photos=$(realpath "${1:-$work/photos}")
if [ $# = 0 ]; then
    for name in one two three four; do cp "$repository/examples/photo3d/sample.jpg" "$work/photos/$name.jpg"; done
    printf 'no photo\n' >"$work/photos/broken.jpg"
fi
if [ -z "${PROGRAMS:-}" ]; then
    (cd "$repository" && cmake --preset release -DLDI_BUILD_TESTS=OFF -DLDI_BUILD_BENCH=OFF &&
        cmake --build --preset release --target photo3d_worker photo3d_queue) >&2
    PROGRAMS=$repository/build/release/examples
fi

start_broker "$work/broker"
read -r port_1 port_2 <<<"$(free_ports 2)"
for port in "$port_1" "$port_2"; do
    "$PROGRAMS/photo3d_worker" --broker "$broker_url" --photos "$photos" --outputs "$outputs" --http "127.0.0.1:$port" \
        >"$work/log.$port" &
    processes+=($!)
done

(cd "$photos" && find . -type f -iregex '.*\.\(jp\(e?g\|e\)\|png\|hei[cf]\|hif\|avif\|webp\|tiff?\|gif\|bmp\)' -printf '%P\n') | sort >"$work/keys"
[ -s "$work/keys" ] || { printf 'no photos in %s\n' "$photos" >&2 && exit 1; }
"$PROGRAMS/photo3d_queue" --broker "$broker_url" submit --photos-per-message 2 <"$work/keys"
"$PROGRAMS/photo3d_queue" --broker "$broker_url" collect --results "$work/results" --dead "$work/dead" \
    --expected "$(wc -l <"$work/keys")"

printf '\nresults:\n'
cat "$work/results"
printf '\ndead letters:\n'
cat "$work/dead"
for port in "$port_1" "$port_2"; do
    printf '\nworker at http://127.0.0.1:%d, health %s' "$port" "$(curl -s "http://127.0.0.1:$port/health")"
    printf '\n%s\n' "$(curl -s "http://127.0.0.1:$port/metrics" | grep '^photo3d_photos_total')"
done
printf '\noutputs in %s\n' "$outputs"
