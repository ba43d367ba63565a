#!/usr/bin/env bash
# run.sh [WORD]: builds the page of examples/web and the program, tests the page in headless Chromium and in Firefox on a virtual screen, and
# compares its results with the program's. With WORD, runs only the tests whose name contains it. PROGRAM is the path of a built program;
# without it, builds one. Writes screenshots to out/web. Installs missing packages. Ends with "N passed, N failed".
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
top=$(cd "$here/../.." && pwd)
# shellcheck source=scripts/requirements.sh
source "$top/scripts/requirements.sh"

require "${needs_web[@]}" "${needs_web_browsers[@]}"
install_npm_packages "$here"
"$top/examples/web/build.sh"
if [ -z "${PROGRAM:-}" ]; then
    "$top/examples/photo3d/run.sh" sample
    PROGRAM=$top/build/photo3d/examples/photo3d
fi
export PROGRAM
with_screen node "$here/web.mjs" "$@"
