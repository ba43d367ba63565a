#!/usr/bin/env bash
# Tests that scripts/tally.sh counts every way in which a suite can end. Prints failures, and fails if there are any.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
wrong=0

# counts FACT EXPECTED SUITE: runs SUITE, a line of bash, and compares the last line of the output with EXPECTED.
counts() {
    local said
    said=$(bash -euo pipefail -c 'source scripts/tally.sh; count_script bash -c "$1"; print_tally' counts "$3" 2>&1 | tail -n 1) || true
    [ "$said" = "$2" ] || { printf 'FAILED: %s: expected "%s", found "%s"\n' "$1" "$2" "$said" && wrong=1; }
}
counts "the counts of a suite are added" "3 passed, 0 failed" 'echo 3 passed, 0 failed'
counts "failures are counted once" "3 passed, 2 failed" 'echo 3 passed, 2 failed; exit 1'
counts "a suite that crashes after its last count counts as failed" "3 passed, 1 failed" 'echo 3 passed, 0 failed; exit 1'
counts "a suite that crashes before its first test counts as failed" "0 passed, 1 failed" 'echo 0 passed, 0 failed; exit 1'
counts "a suite that prints no counts counts as failed" "0 passed, 1 failed" 'echo ready'
counts "a suite that crashes without counts counts as one failure" "0 passed, 1 failed" 'echo ready; exit 139'

# Counts of three commands that run at the same time.
check() { [ "$1" != bad ]; }
together() { (source scripts/tally.sh && count_together "at once" check "$@" && print_tally) 2>&1 | tail -n 1 || true; }
said="$(together one bad three); $(together one two)"
[ "$said" = "2 passed, 1 failed; 2 passed, 0 failed" ] || { printf 'FAILED: simultaneous commands are counted: found "%s"\n' "$said" && wrong=1; }
exit "$wrong"
