#!/usr/bin/env bash
# Measures the quality of the weights on photographs that no network was trained on: fills of 200 fixed holes, and depth compared to
# measurements. Prints Markdown and ends with "farbrausch +D.DD dB, student +D.DDD delta, edges D.DDD". Installs missing packages. Takes
# 8 minutes on one core.
#
#   examples/training/evaluate.sh [FOLDER]      FOLDER: folder of the weights; default: examples/models
#
# Writes pictures to out/training. Reads photographs from ../shared. Skips a table if its photographs are missing, and reports this in the
# last line.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_compiler[@]}" "${needs_weight_files[@]}" "${needs_training[@]}" >&2

models=$(realpath "${1:-$root/examples/models}")
shared=$root/../shared
built=$root/build/training
pictures=$root/out/training
mkdir -p "$built" "$pictures"
export PYTHONDONTWRITEBYTECODE=1

# Succeeds if all given paths exist. Otherwise prints the first missing one.
are_there() {
    local path
    for path in "$@"; do
        if [ ! -e "$path" ]; then
            printf 'skipped: there is no %s\n' "$path"
            return 1
        fi
    done
}

# Compiles a program of this folder, which uses only the library.
compile() {
    "${CXX:-g++}" -std=c++20 -O2 -I"$root/include" "$here/$1.cpp" -o "$built/$(basename "$1")"
}

# Runs a program of this folder and keeps its output.
measure() {
    local kept=$1 start=$SECONDS
    shift
    (cd "$here" && /usr/bin/python3 "$@") | tee "$built/$kept"
    printf '\n(%d s)\n' $((SECONDS - start))
}

# Prints the last line of a table: the difference, or "not measured".
difference() {
    { [ -f "$built/$1" ] && grep -E "^$2 [+-]" "$built/$1" || printf '%s not measured\n' "$2"; } | tail -n 1
}
rm -f "$built/inpainting.md" "$built/depth.md"

printf '## Inpainting\n\n'
if are_there "$shared/photos/eval" "$models/farbrausch.safetensors"; then
    compile farbrausch/inpaint
    perceived=()
    are_there "$shared/lpips/lpips.py" && perceived=(--lpips "$shared/lpips")
    measure inpainting.md farbrausch/evaluate.py --photos "$shared/photos/eval" --weights "$models/farbrausch.safetensors" \
        --inpaint "$built/inpaint" --sheets "$pictures" "${perceived[@]}"
fi

printf '\n## Depth\n\n'
if are_there "$shared/rgbd" "$shared/tiefenrausch/model" "$models/tiefenrausch_small.safetensors"; then
    compile tiefenrausch_small/estimate
    compile tiefenrausch_small/convert
    subjects=()
    if are_there "$shared/segmentation" "$shared/photos/train_research"; then
        subjects=(--segmentation "$shared/segmentation" --subjects "$shared/photos/eval" --subjects "$shared/photos/train_research")
    fi
    measure depth.md tiefenrausch_small/evaluate.py --pairs "$shared/rgbd" --estimate "$built/estimate" --convert "$built/convert" \
        --published "$shared/tiefenrausch/model" --student "$models/tiefenrausch_small.safetensors" --sheet "$pictures/depth.png" "${subjects[@]}"
fi

printf '\n%s, %s\n' "$(difference inpainting.md farbrausch)" "$(difference depth.md student)"
