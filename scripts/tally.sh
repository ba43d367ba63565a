# Runs test suites and commands, and counts passes and failures. tests/run.sh, tests/emulated/*.sh and .ci/run source this file.
#
#   build_and_test PRESET [CMAKE_OPTION...]   builds a preset and runs its tests with CTest. A failed build counts as one failure.
#                                             Optional variables: build_targets, a list of targets to build instead of all;
#                                             only_labels, exclude_labels and only_tests, regular expressions that select tests by
#                                             label and by name
#   count_step NAME COMMAND...                runs a command, which counts as one test
#   count_together WHERE COMMAND ARGUMENT...  runs COMMAND once with each ARGUMENT, in one process per core. Each run counts as one test,
#                                             named "ARGUMENT WHERE". Prints the output of all runs after the last one has ended. Each
#                                             line of output with "skipped: " in it counts as a skipped test
#   add_tally "N passed, N failed"            adds these counts. "0 passed, 0 failed" counts as one skipped test, any other text as one
#                                             failure
#   add_tally_of LOG                          adds the tally in a log's last line, and the number of skipped tests that print_tally
#                                             printed above it
#   count_script COMMAND...                   runs a script that prints a tally in its last line, and adds the counts. A script that fails
#                                             without reporting a failure counts as one failure
#   print_tally                               prints "N passed, N failed", and above it the number of skipped tests, which count as
#                                             neither; fails if any test failed

# shellcheck shell=bash

passed=0
failed=0
skipped=0
jobs=$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)

count_step() {
    local name=$1 start=$SECONDS
    shift
    printf '\n== %s\n' "$name"
    if "$@"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf 'FAILED: %s\n' "$name"
    fi
    printf '== %s took %d s\n' "$name" $((SECONDS - start))
}

count_together() {
    local where=$1 command=$2 logs argument
    shift 2
    logs=$(mktemp -d)
    for argument; do
        while [ "$(jobs -pr | wc -l)" -ge "$jobs" ]; do wait -n || true; done
        { "$command" "$argument" >"$logs/$argument" 2>&1 && touch "$logs/$argument.passed"; } &
    done
    wait
    for argument; do
        printf '\n== %s %s\n' "$argument" "$where"
        cat "$logs/$argument"
        skipped=$((skipped + $(grep -c 'skipped: ' "$logs/$argument" || true)))
        if [ -e "$logs/$argument.passed" ]; then
            passed=$((passed + 1))
        else
            failed=$((failed + 1))
            printf 'FAILED: %s %s\n' "$argument" "$where"
        fi
    done
    rm -r "$logs"
}

build_and_test() {
    local preset=$1 start=$SECONDS built log summary targets omitted
    shift
    read -ra targets <<<"${build_targets:-}"
    printf '\n== %s\n' "$preset"
    built=$SECONDS
    if ! { cmake --preset "$preset" "$@" >/dev/null && cmake --build --preset "$preset" --parallel "$jobs" ${targets[@]+--target "${targets[@]}"} -- -k 0; }; then
        failed=$((failed + 1))
        printf 'FAILED: %s does not build\n' "$preset"
    fi
    printf '== %s: built in %d s\n' "$preset" $((SECONDS - built))

    log=$(mktemp)
    ctest --preset "$preset" --parallel "$jobs" ${only_labels:+--label-regex "$only_labels"} \
        ${exclude_labels:+--label-exclude "$exclude_labels"} ${only_tests:+--tests-regex "$only_tests"} 2>&1 | tee "$log" || true
    # "94% tests passed, 3 tests failed out of 50"
    summary=$(sed -nE 's/^[0-9]+% tests passed, ([0-9]+) tests failed out of ([0-9]+)$/\1 \2/p' "$log")
    if [ -n "$summary" ]; then
        omitted=$(grep -c -F '***Skipped' "$log" || true)
        skipped=$((skipped + omitted))
        failed=$((failed + ${summary% *}))
        passed=$((passed + ${summary#* } - ${summary% *} - omitted))
    else
        failed=$((failed + 1))
        printf 'FAILED: %s ran no test\n' "$preset"
    fi
    rm -f "$log"
    printf '== %s took %d s\n' "$preset" $((SECONDS - start))
}

add_tally() {
    if [[ $1 =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
        passed=$((passed + BASH_REMATCH[1]))
        failed=$((failed + BASH_REMATCH[2]))
        [ "$1" != "0 passed, 0 failed" ] || skipped=$((skipped + 1))
    else
        failed=$((failed + 1))
    fi
}

add_tally_of() {
    local omitted
    omitted=$(tail -n 3 "$1" | sed -nE 's/^([0-9]+) tests were skipped$/\1/p')
    skipped=$((skipped + ${omitted:-0}))
    add_tally "$(tail -n 1 "$1")"
}

count_script() {
    local log start=$SECONDS status=0 failed_before=$failed
    printf '\n== %s\n' "$1"
    log=$(mktemp)
    "$@" 2>&1 | tee "$log" || status=$?
    add_tally_of "$log"
    if [ "$status" != 0 ] && [ "$failed" = "$failed_before" ]; then
        failed=$((failed + 1))
        printf 'FAILED: %s ended with status %d\n' "$1" "$status"
    fi
    rm -f "$log"
    printf '== %s took %d s\n' "$1" $((SECONDS - start))
}

print_tally() {
    [ "$skipped" = 0 ] || printf '\n%d tests were skipped\n' "$skipped"
    printf '\n%d passed, %d failed\n' "$passed" "$failed"
    [ "$failed" = 0 ]
}
