# Provides photographs for benchmarks of many photos. bench/batch/run.sh and bench/service/run.sh source this file.
#
#   photos=$(photos_for NUMBER [FOLDER])   prints FOLDER; default: ../shared/photos/train if it exists, else a folder in build/ with
#                                          NUMBER copies of the shipped sample

# shellcheck shell=bash
photos_for() {
    local folder=${2:-../shared/photos/train}
    if [ -n "${2:-}" ] && [ ! -d "$folder" ]; then
        printf '%s: expected a folder of photos, found none\n' "$folder" >&2
        return 1
    fi
    if [ ! -d "$folder" ]; then
        folder=build/copies_of_sample
        rm -rf "$folder"
        mkdir -p "$folder"
        for number in $(seq -w "$1"); do cp examples/photo3d/sample.jpg "$folder/sample_$number.jpg"; done
    fi
    realpath "$folder"
}
