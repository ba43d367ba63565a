#!/usr/bin/env bash
# run.sh [ROUNDS]: measures the page of examples/web in headless Chromium and in Firefox on a virtual screen: the time from choosing a photo
# until its 3D photo moves, for the first photo after the page is ready and for later ones; the stages' times, the memory, the download
# size, and the frame rate of the moving 3D photo. Then compares the depth network in WebAssembly with ONNX Runtime Web and TensorFlow.js
# (bench/peers/tiefenrausch_webassembly.sh), if ../shared has the published network. Installs missing packages. Ends with
# "photo to 3D photo D ms, depth ratio D.DD": the median time of photos after the first in Chromium, and our time for the depth network
# divided by that of the faster peer (0 without a peer).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
rounds=${1:-5}
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_web[@]}" "${needs_web_browsers[@]}"
install_npm_packages "$top/tests/web"
"$top/examples/web/build.sh" >/dev/null
log=$(mktemp)
trap 'rm -f "$log"' EXIT
with_screen node "$here/page.mjs" "$rounds" | tee "$log"
photo=$(tail -n 1 "$log")
"$top/bench/peers/tiefenrausch_webassembly.sh" "$rounds" | tee "$log" || [ $? = 75 ] # 75: the published network or the peers are absent
ratio=$(sed -n 's/^ratio //p' "$log")
printf 'photo to 3D photo %.0f ms, depth ratio %.2f\n' "${photo##* }" "${ratio:-0}"
