#!/usr/bin/env bash
# Tests examples/service/photos.sbatch on a cluster of one node, which it starts in a temporary folder: munge, slurmctld and slurmd as the
# current user, on unused ports. Ends with "N passed, N failed".
#
# The cluster has no accounting and no cgroups (proctrack/linuxproc, task/none), so that it also runs in a container. Slurm therefore does
# not limit the use of cores and memory. It counts cores (select/cons_tres), so that tasks wait for each other as on a real cluster.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=scripts/tally.sh
source scripts/tally.sh
# shellcheck source=examples/service/broker.sh
source examples/service/broker.sh

work=$(mktemp -d)
chmod 755 "$work" # munged requires it
processes=()
clean_up() {
    [ -z "${KEEP_SLURM:-}" ] || cp -r "$work" "$KEEP_SLURM"
    [ "${#processes[@]}" = 0 ] || kill -TERM "${processes[@]}" 2>/dev/null || true
    [ "${#processes[@]}" = 0 ] || wait "${processes[@]}" 2>/dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT

start_cluster() {
    local node controller_port node_port user
    node=$(hostname -s) user=$(id -un)
    read -r controller_port node_port <<<"$(free_ports 2)"
    mkdir -p "$work/state" "$work/spool" "$work/munge"
    head -c 1024 /dev/urandom >"$work/munge/key"
    chmod 700 "$work/munge"
    chmod 600 "$work/munge/key"
    /usr/sbin/munged --foreground --socket "$work/munge.socket" --key-file "$work/munge/key" --pid-file "$work/munge/pid" \
        --log-file "$work/munge/log" --seed-file "$work/munge/seed" --force >"$work/munge/output" 2>&1 &
    processes+=($!)
    cat >"$work/slurm.conf" <<CONFIGURATION
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
SlurmctldPort=$controller_port
SlurmdPort=$node_port
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$node Default=YES State=UP
CONFIGURATION
    export SLURM_CONF=$work/slurm.conf
    until [ -S "$work/munge.socket" ]; do
        kill -0 "${processes[0]}"
        sleep 0.1
    done
    slurmctld -D >"$work/slurmctld.log" 2>&1 &
    processes+=($!)
    slurmd -D -N "$node" >"$work/slurmd.log" 2>&1 &
    processes+=($!)
    for _ in $(seq 300); do
        sinfo -h -o %t 2>/dev/null | grep -q '^idle' && return
        sleep 0.1
    done
    tail -n 20 "$work/slurmctld.log" "$work/slurmd.log" "$work/munge/log"
    return 1
}

photos=$work/photos
make_list() {
    local i
    mkdir "$photos"
    for i in $(seq 1 8); do
        cp examples/photo3d/sample.jpg "$photos/$i.jpg"
        printf '"%s"\n' "$photos/$i.jpg"
    done >"$work/list.jsonl"
    printf 'no photo\n' >"$photos/9.jpg"
    printf '"%s"\n' "$photos/9.jpg" >>"$work/list.jsonl"
}

# Submits the list as an array of three tasks, and prints their exit codes. (sbatch --wait would poll only every ten seconds.)
submit() {
    local job
    job=$(PHOTO3D=$(realpath "$PROGRAMS/photo3d") sbatch --parsable --array=0-2 --output="$work/task.%a" \
        examples/service/photos.sbatch "$work/list.jsonl" "$work/outputs" --size 512)
    while [ -n "$(squeue -h -j "$job")" ]; do sleep 0.2; done
    scontrol show job "$job" | sed -nE 's/.* ExitCode=([0-9]+):.*/\1/p' | sort | tr '\n' ' '
}

is_each_there_once() {
    [ "$(find "$work/outputs" -name '*.glb' | wc -l)" = 8 ] && [ "$(cat "$work"/outputs/log/*.jsonl | wc -l)" = 9 ] &&
        [ "$(cat "$work"/outputs/log/*.jsonl | grep -c '"code":"unsupported"')" = 1 ]
}
have_slices() { [ "$(wc -l <"$work/outputs/log/0.jsonl") $(wc -l <"$work/outputs/log/1.jsonl") $(wc -l <"$work/outputs/log/2.jsonl")" = "3 3 3" ]; }
fails_with_one() { [ "$(submit)" = "0 0 1 " ]; }
number_of() { cat "$work"/outputs/log/*.jsonl | grep -c "$1"; }
is_nothing_converted() { [ "$(number_of '"milliseconds"') $(number_of '"skipped":true')" = "8 8" ]; }

# Runs the task's script directly; it must refuse the list before it starts the program.
is_refused() {
    local said status=0
    printf '%s\n' "${@:2}" >"$work/twice.jsonl"
    said=$(PHOTO3D=false SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_COUNT=2 bash examples/service/photos.sbatch "$work/twice.jsonl" "$work/none" 2>&1) ||
        status=$?
    [ "$status $said" = "$1" ]
}
refuses_equal_names() {
    local default=$work/none/1.glb
    local refusal="2 $work/twice.jsonl: several photos have the output $default; name their outputs in the list"
    is_refused "$refusal" '"/a/1.jpg"' '"/b/2.jpg"' '"/b/1.png"' && is_refused "$refusal" '"/a/1.jpg"' '{"photo" : "/b/1.heic"}' &&
        is_refused "$refusal" '"/a/1.jpg"' "{\"photo\": \"/b/2.jpg\", \"output\": \"$work/none/../none/1.glb\"}" &&
        is_refused "${refusal/$default/$PWD/x.glb}" '{"photo": "1.jpg", "output": "x.glb"}' '{"output" : "./x.glb", "photo": "2.jpg"}' &&
        is_refused "1 " '{"foto": "1.jpg"}' '{"foto": "1.jpg"}' '[1]' '[1]' && is_refused "1 " '"/a/1.jpg"' '{"photo": "/b/1.jpg", "output": "b1.glb"}' '"/b/2.jpg"' && is_refused "1 " '{"photo": "1.jpg", "output": "x.glb"}'
}

# Runs the task's script directly, with a program that ends with code 75 and a scontrol that records its arguments. Prints its exit code and
# the words that scontrol got.
requeued() {
    local status=0
    mkdir -p "$work/bin"
    printf '#!/bin/sh\nexit 75\n' >"$work/bin/photo3d"
    printf '#!/bin/sh\necho "$@" >>%q\n' "$work/requeued" >"$work/bin/scontrol"
    printf '#!/bin/sh\n' >"$work/bin/sleep"
    chmod +x "$work"/bin/*
    : >"$work/requeued"
    PATH=$work/bin:$PATH PHOTO3D=photo3d SLURM_ARRAY_TASK_ID=7 SLURM_ARRAY_JOB_ID=12 SLURM_RESTART_COUNT=$1 SLURM_ARRAY_TASK_COUNT=9 \
        bash examples/service/photos.sbatch "$work/one.jsonl" "$work/none" || status=$?
    printf '%s %s' "$status" "$(cat "$work/requeued")"
}
is_requeued_five_times() {
    printf '"/a/1.jpg"\n' >"$work/one.jsonl"
    [ "$(requeued 0)" = "75 requeue 12_7" ] && [ "$(requeued 4)" = "75 requeue 12_7" ] && [ "$(requeued 5)" = "75 " ]
}

# One task of the array, submitted alone with SLICES, must process the same lines as before.
has_lines_of_slice() {
    printf '"/a/%d.jpg"\n' 1 2 3 4 5 6 7 >"$work/seven.jsonl"
    printf '#!/bin/sh\ncat >%q\n' "$work/slice" >"$work/bin/photo3d"
    PATH=$work/bin:$PATH PHOTO3D=photo3d SLICES=3 SLURM_ARRAY_TASK_ID=2 SLURM_ARRAY_TASK_MIN=2 SLURM_ARRAY_TASK_MAX=2 SLURM_ARRAY_TASK_COUNT=1 \
        bash examples/service/photos.sbatch "$work/seven.jsonl" "$work/none" && [ "$(cat "$work/slice")" = $'"/a/2.jpg"\n"/a/5.jpg"' ]
}

# Without the tasks between its steps, photos would be skipped.
refuses_steps() {
    local said
    ! said=$(PHOTO3D=true SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_MIN=0 SLURM_ARRAY_TASK_MAX=98 SLURM_ARRAY_TASK_COUNT=50 \
        bash examples/service/photos.sbatch "$work/twice.jsonl" "$work/none" 2>&1) && [[ $said == *"found 50 tasks from 0 to 98" ]]
}

# task_with [NAME=VALUE...] -- [OPTION...]: runs a task's script with these variables and further arguments, and prints the arguments that
# photo3d got after --threads, or the exit code and the message.
task_with() {
    local variables=() said status=0
    while [ "$1" != -- ]; do
        variables+=("$1")
        shift
    done
    : >"$work/words"
    printf '#!/bin/sh\ncat >/dev/null\necho "$*" | sed "s/.* --threads/--threads/" >%q\n' "$work/words" >"$work/bin/photo3d"
    said=$(env PATH="$work/bin:$PATH" PHOTO3D=photo3d SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_COUNT=1 "${variables[@]}" \
        bash examples/service/photos.sbatch "$work/one.jsonl" "$work/none" "${@:2}" 2>&1) || status=$?
    [ "$status" = 0 ] && cat "$work/words" || printf '%s %s' "$status" "$said"
}
passes_options() {
    [ "$(task_with -- --compress --size 1024)" = "--threads 1 --compress --size 1024" ] &&
        [ "$(task_with SLURM_CPUS_PER_TASK=8 --)" = "--threads 8" ]
}
derives_memory() {
    [ "$(task_with SLURM_MEM_PER_NODE=2000 -- --compress)" = "--threads 1 --compress --memory 1800MB" ] &&
        [ "$(task_with SLURM_MEM_PER_CPU=1000 SLURM_CPUS_PER_TASK=4 --)" = "--threads 4 --memory 3600MB" ] &&
        [ "$(task_with SLURM_MEM_PER_NODE=0 --)" = "--threads 1" ] &&
        [ "$(task_with SLURM_MEM_PER_NODE=2000 -- --memory=1GB)" = "--threads 1 --memory=1GB" ] &&
        [ "$(task_with SLURM_MEM_PER_NODE=2000 -- --memory 1GB)" = "--threads 1 --memory 1GB" ]
}
refuses_options() {
    local option
    for option in --threads=2 --threads -o -oout --output=out --batch --skip-existing --quiet --gallery=all.html more.jpg; do
        [[ $(task_with -- "$option" 2) == "2 $option: expected an option of "* ]] || return 1
    done
}

count_step "a list with two photos that would have the same output is refused" refuses_equal_names
count_step "an array with a step is refused" refuses_steps
count_step "a task that may succeed later is requeued up to five times" is_requeued_five_times
count_step "a task that is submitted alone with SLICES has its own lines" has_lines_of_slice
count_step "a task passes further options to photo3d" passes_options
count_step "a task limits photo3d to the memory that Slurm allocated, unless --memory is given" derives_memory
count_step "a task refuses options that it sets itself" refuses_options
if ! count_step "a cluster of one node starts" start_cluster || [ "$failed" != 0 ]; then
    print_tally
    exit 1
fi
make_list
count_step "only the task with an invalid photo ends with exit code 1" fails_with_one
cat "$work"/task.* || true
count_step "each valid photo in the list is converted once" is_each_there_once
count_step "each task processes a third of the list" have_slices
count_step "the same list, submitted again, ends with the same exit codes" fails_with_one
count_step "the second run skips all converted photos" is_nothing_converted
print_tally
