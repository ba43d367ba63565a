#!/usr/bin/env bash
# run.sh FILE.glb...: fetches the Khronos glTF validator if it is not here yet, and ends with 0 if no file has an error or warning.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[ -d "$here/node_modules/gltf-validator" ] || npm ci --prefix "$here" --no-audit --no-fund >&2
node "$here/validate.mjs" "$@"
