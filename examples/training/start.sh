#!/bin/sh
# Starts or resumes a training run in the background, on all processors, at the lowest priority.
#   start.sh RECIPE FOLDER [options of RECIPE/train.py]      RECIPE: farbrausch, silhouettes or tiefenrausch_small; FOLDER: for all outputs
set -e
here=$(cd "$(dirname "$0")" && pwd)
if [ $# -lt 2 ] || [ ! -e "$here/$1/train.py" ]; then
    printf 'expected a RECIPE (farbrausch, silhouettes or tiefenrausch_small) and a FOLDER, found: %s\n' "${*:-nothing}" >&2
    exit 1
fi
recipe=$1 folder=$2
shift 2
mkdir -p "$folder"
if [ -e "$folder/pid" ] && grep -qs "$recipe/train.py" "/proc/$(cat "$folder/pid")/cmdline"; then
    printf '%s: expected a folder without a running training, found process %s\n' "$folder" "$(cat "$folder/pid")" >&2
    exit 1
fi
rm -f "$folder/stop"
# Without these settings, the C library returns the memory of every large tensor to the system, which takes a fifth of the training time.
export MALLOC_TRIM_THRESHOLD_=8000000000 MALLOC_MMAP_THRESHOLD_=8000000000
export PYTHONDONTWRITEBYTECODE=1
setsid nohup nice -n 19 chrt -i 0 /usr/bin/python3 "$here/$recipe/train.py" --out "$folder" "$@" \
    >> "$folder/output.txt" 2>&1 < /dev/null &
echo $! > "$folder/pid"
# Linux first divides processor time among sessions (autogroup), so nice has an effect only within the session. setsid creates the
# training's session; until then the process belongs to this script's session, whose priority must not change.
while [ -e "/proc/$!/autogroup" ] && cmp -s "/proc/$!/autogroup" /proc/self/autogroup; do sleep 0.1; done
if [ -w "/proc/$!/autogroup" ]; then echo 19 > "/proc/$!/autogroup"; fi
echo "process $(cat "$folder/pid"); see $folder/output.txt and $folder/log.tsv"
