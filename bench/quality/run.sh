#!/usr/bin/env bash
# Measures the quality of 3D photos: the networks' depth, novel views compared to photographs from the same place, silhouettes, the
# paper's measure of inpainting, sizes, times. Prints Markdown, writes pictures to out/quality, and ends with "ldi over screen space +D.DD dB,
# uncovered D.DDD %, lpips D.DDD (diffusion D.DDD), silhouettes D.D px, halo D.D" in one line.
#
#   bench/quality/run.sh [--inpainting-model FILE] [OPTION...]     options: --no-depth, --no-views, --no-sizes skip these parts;
#                                                                  --silhouette-model FILE or none, with --only, too
#   bench/quality/run.sh --only silhouettes [OPTION...]            takes minutes; options: --no-pairs (skips pairs and scenes with
#                                                                  true depth), --no-scenes, --no-photographs, --no-holes,
#                                                                  --sigma SAMPLES, --shift SAMPLES (of the degraded depth),
#                                                                  --before FOLDER (pictures of an earlier run, to compare)
#   bench/quality/run.sh --only holes [PHOTO...] [OPTION...]       takes minutes; options: --crops FOLDER, --each,
#                                                                  --geometry-size PIXELS
#
# The default model is examples/models/farbrausch.safetensors. LPIPS needs the weights in ../shared/lpips. The photographs with depth and
# the stereo pairs are in ../shared/rgbd. Parts whose data is absent are skipped; the ray-cast scenes need no data.
# examples/training/evaluate.sh measures depth in more detail.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$root/scripts/requirements.sh"
require "${needs_build[@]}" "${needs_io[@]}" "${needs_photo3d[@]}" "${needs_bench[@]}" >&2

build() {
    cmake -S "$root" -B "$root/build/release" -G Ninja -DCMAKE_BUILD_TYPE=Release -DLDI_BUILD_BENCH=ON >&2
    cmake --build "$root/build/release" --target "$1" >&2
}

if [[ ${1:-} == --only && ${2:-} == silhouettes ]]; then
    build ldi_quality_silhouettes
    exec "$root/build/release/bench/ldi_quality_silhouettes" --pictures "$root/out/quality" "${@:3}"
fi
if [[ ${1:-} == --only && ${2:-} == holes ]]; then
    build ldi_quality_holes
    exec "$root/build/release/bench/ldi_quality_holes" "${@:3}"
fi

options=("$@")
if [[ " ${options[*]} " != *" --inpainting-model"* ]]; then
    model=$root/examples/models/farbrausch.safetensors
    if [ ! -f "$model" ]; then
        printf 'expected weights at %s, found no file: name one with --inpainting-model FILE\n' "$model" >&2
        exit 1
    fi
    options+=(--inpainting-model "$model")
fi
weights=$root/../shared/lpips/lpips_squeeze_oihw.npz
if [[ " ${options[*]} " != *" --lpips"* && -f $weights ]]; then
    mkdir -p "$root/build"
    python3 "$root/bench/quality/lpips_weights.py" "$weights" "$root/build/lpips_squeeze.safetensors"
    options+=(--lpips "$root/build/lpips_squeeze.safetensors")
fi
build ldi_quality
"$root/build/release/bench/ldi_quality" --pictures "$root/out/quality" "${options[@]}"
