#!/bin/sh
# Starts a training, or goes on with it, in the background on processor time that nobody else wants, on all processors.
#   start.sh RECIPE FOLDER [options of RECIPE/train.py]      RECIPE: farbrausch, silhouettes or tiefenrausch_small; FOLDER: for all that is written
set -e
here=$(cd "$(dirname "$0")" && pwd)
recipe=$1 folder=$2
shift 2
mkdir -p "$folder"
rm -f "$folder/stop"
# Without these the C library gives every large tensor back to the system and gets it again, page by page: a fifth of the time.
export MALLOC_TRIM_THRESHOLD_=8000000000 MALLOC_MMAP_THRESHOLD_=8000000000
export PYTHONDONTWRITEBYTECODE=1
setsid nohup nice -n 19 chrt -i 0 /usr/bin/python3 "$here/$recipe/train.py" --out "$folder" "$@" \
    >> "$folder/output.txt" 2>&1 < /dev/null &
echo $! > "$folder/pid"
# Linux shares out time between sessions first (autogroup): niceness alone would only count within one. The training's is there as soon
# as setsid has made it; until then the process is in ours, which must not become as patient.
while [ -e "/proc/$!/autogroup" ] && cmp -s "/proc/$!/autogroup" /proc/self/autogroup; do sleep 0.1; done
if [ -w "/proc/$!/autogroup" ]; then echo 19 > "/proc/$!/autogroup"; fi
echo "process $(cat "$folder/pid"); see $folder/output.txt and $folder/log.tsv"
