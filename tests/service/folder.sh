# Part of tests/service/run.sh: photos in a folder, invalid messages, messages that kill their workers, and metrics.

# shellcheck shell=bash disable=SC2154

folder=$work/folder
mkdir -p "$folder/photos" "$folder/outputs"
for name in a b c; do cp "$one_photo" "$folder/photos/$name.jpg"; done
printf 'no photo\n' >"$folder/photos/d.jpg"
printf '%s\n' a.jpg b.jpg '' c.jpg d.jpg >"$folder/keys" # submit skips the blank line

start_worker calm calm "$folder/photos" "$folder/outputs"
calm=$worker_address
count_step "a worker is healthy" wait_until 20 health_is "$calm" 200
for text in nonsense '{"job": "j", "photos": []}' '{"job": "j", "photos": ["../keys"]}' '{"job": "j", "photos": ["/etc/passwd"]}'; do
    amqp-publish -u "$broker_url" -r calm -b "$text"
done
queue calm submit --job j <"$folder/keys"
queue calm collect --results "$folder/results" --dead "$folder/dead" --expected 8 >/dev/null
names_the_job() { ! { seq 300 && echo folder/; } | queue half submit --job half --photos-per-message 1 2>"$folder/half" && grep -q 'use --job half$' "$folder/half"; }
count_step "a submission that fails after sending messages names its job" names_the_job
is_refused_at_line_2() { ! printf 'a.jpg\nfolder/\n' | queue calm submit --job refused 2>"$folder/refused" && grep -q 'line 2: expected' "$folder/refused"; }
count_step "a folder as a key is refused before its message is sent" is_refused_at_line_2
count_step "invalid messages become dead letters" documents codes_are "$folder/dead" "invalid data" "invalid data" "invalid data" \
    "invalid data" unsupported
do_numbers_agree() { curl -s "$calm/metrics" >"$folder/metrics" && documents numbers_agree "$folder/results" "$folder/dead" "$folder/metrics"; }
count_step "metrics equal the numbers of results and dead letters" wait_until 20 do_numbers_agree # counted after the acknowledgment
if command -v promtool >/dev/null; then
    count_step "promtool accepts the metrics" promtool check metrics <"$folder/metrics"
else
    printf 'skipped: the check of metrics needs promtool (Debian: prometheus)\n'
fi

# Submits the same job again: the worker finds the results, and the collector drops the duplicates.
cp "$folder/results" "$folder/before"
queue calm submit --job j <"$folder/keys"
queue calm submit --job k <"$folder/keys"
queue calm collect --results "$folder/results" --dead "$folder/dead" --expected 12 >"$folder/collected"
cat "$folder/collected"
count_step "the collector drops the results of a job that is submitted twice" grep -q '"results":6,"dead":6,"dropped":4' "$folder/collected"
count_step "photos of a job that is submitted again are not converted again" documents have_events "$worker_log" "already done" 3
count_step "the failed photo of that job, and all photos of another job, are converted again" documents have_events "$worker_log" photo 9
stop_worker TERM "$worker"
count_step "a worker logs its end after a signal" documents have_events "$worker_log" end 1

submits_with_slash() { echo a.jpg | "$PROGRAMS/photo3d_queue" --broker "$broker_url/" --queue slash submit --job slash; }
count_step "an address of a broker may end in a slash" submits_with_slash

# A pipe without a writer, and a link to a file outside the folder, must be refused. A file of another program must not be replaced.
mkfifo "$folder/photos/pipe.jpg"
ln -s ../keys "$folder/photos/link.jpg"
cp "$one_photo" "$folder/photos/kept.jpg"
printf '{"message": "my holiday"}\n' >"$folder/outputs/kept.jpg.json"
cp "$one_photo" "$folder/photos/taken.jpg"
mkdir "$folder/outputs/taken.jpg.json"
printf '%s\n' pipe.jpg a.jpg link.jpg kept.jpg taken.jpg >"$folder/odd"
queue calm submit --job odd <"$folder/odd"
start_worker odd calm "$folder/photos" "$folder/outputs"
queue calm collect --results "$folder/odd_results" --dead "$folder/odd_dead" --expected 5 >/dev/null
count_step "photos that are not plain files, or whose document would replace another program's file or a folder, become dead letters" \
    documents codes_are "$folder/odd_dead" "file access" "file access" "file access" "file access"
is_not_converted() { [ ! -e "$folder/outputs/taken.jpg.glb" ]; }
count_step "a photo whose document can't be written is not converted" is_not_converted
count_step "another program's file is kept" grep -q '^{"message": "my holiday"}$' "$folder/outputs/kept.jpg.json"
stop_worker TERM "$worker"

# The GLB file of this photo is larger than a worker may write, so that the system ends every worker that receives the photo.
cp examples/photo3d/sample.jpg "$folder/photos/large.jpg"
printf '%s\n' a.jpg large.jpg b.jpg >"$folder/deadly"
queue deadly submit --job e <"$folder/deadly"
queue deadly collect --results "$folder/deadly_results" --dead "$folder/deadly_dead" --expected 3 >/dev/null &
collector=$!
is_over() { has_ended "$worker" || has_ended "$collector"; }
for ((ended = 0; ended < 20; ++ended)); do
    kilobytes_of_file=300 start_worker "deadly.$ended" deadly "$folder/photos" "$folder/outputs"
    wait_until 60 is_over || break
    ! has_ended "$collector" || break
    stop_worker KILL "$worker" # the worker has already ended; this only reads its exit status
done
stop_worker KILL "$worker"
printf '%d workers ended\n' "$ended"
count_step "a photo that kills every worker becomes a dead letter" documents codes_are "$folder/deadly_dead" delivery_limit
count_step "a photo that kills every worker is delivered five times" documents was_given_out 5 "$work"/deadly.*.log
count_step "in a job with a photo that kills workers, every photo has exactly one result or dead letter" documents each_once "$folder/deadly" "$folder/deadly_results" "$folder/deadly_dead"
wait "$collector" || true
collector=

# A photo that takes longer than --photo-timeout: the worker ends, and its last line names the photo.
python3 -c 'import sys
sys.path.insert(0, "tests/program")
from files import png
sys.stdout.buffer.write(png(12000, 12000, 1, lambda y: bytes(12000)))' >"$folder/photos/endless.jpg"
start_worker slow slow "$folder/photos" "$folder/outputs" --photo-timeout 0.1
queue slow submit --job s <<<endless.jpg
ends_with_75() { wait_until 60 has_ended "$worker" && { wait "$worker" || [ $? = 75 ]; }; }
count_step "a photo that takes too long ends the worker with exit code 75" ends_with_75
names_slow_photo() { tail -n 1 "$worker_log" | grep -q '"event":"photo timeout".*"photo":"endless.jpg"'; }
count_step "the worker's last line names this photo" names_slow_photo
stop_worker KILL "$worker"

# If the storage remains unreachable, the worker retries and then returns the message to the queue. After five deliveries, the message
# becomes a dead letter that recommends another try.
start_worker away away "$folder/nowhere" "$folder/outputs" --patience 0
queue away submit --job w <<<a.jpg
queue away collect --results "$folder/away_results" --dead "$folder/away_dead" --expected 1 >/dev/null
count_step "a photo whose storage remains unreachable becomes a dead letter" documents codes_are "$folder/away_dead" "unavailable for now"
count_step "the dead letter of a photo with unreachable storage recommends another try" grep -q '"try_again":true' "$folder/away_dead"
count_step "the message of a photo with unreachable storage is delivered five times" documents was_given_out 5 "$worker_log"
stop_worker TERM "$worker"

control_broker() {
    HOME=$work/broker ERL_EPMD_PORT=$broker_names_port RABBITMQ_CONF_ENV_FILE=$work/broker/environment \
        RABBITMQ_NODENAME=ldi-$broker_port@localhost /usr/lib/rabbitmq/bin/rabbitmqctl --quiet "$@"
}

# queue_has NAME NUMBER
queue_has() { [ "$(control_broker list_queues --no-table-headers name messages | awk -v name="$1" '$1 == name { print $2 }')" = "$2" ]; }

# A worker that is asked to end publishes the document of its current photo, so that no other worker has to look at it.
cp examples/photo3d/sample.jpg "$folder/photos/sample.jpg"
start_worker ending ending "$folder/photos" "$folder/outputs"
queue ending submit --job t <<<sample.jpg
wait_until 60 grep -q '"event":"message"' "$worker_log"
sleep 0.1 # until the conversion has begun
stop_worker TERM "$worker"
queue ending collect --results "$folder/ending_results" --dead "$folder/ending_dead" --expected 1 >/dev/null
count_step "a worker that ends after a signal publishes the document of its current photo" grep -q '"photo":"sample.jpg"' "$folder/ending_results"
count_step "a worker that ends after a signal acknowledges the message that it has completed" wait_until 20 queue_has ending 0
start_worker busy busy "$folder/photos" "$folder/outputs"
first_log=$worker_log
for ((i = 0; i < 8; ++i)); do
    ln "$folder/photos/sample.jpg" "$folder/photos/sample$i.jpg"
    echo "sample$i.jpg"
done >"$folder/busy"
queue busy submit --job t --photos-per-message 8 <"$folder/busy"
wait_until 60 grep -q '"event":"message"' "$worker_log"
stop_worker TERM "$worker"
start_worker next busy "$folder/photos" "$folder/outputs"
queue busy collect --results "$folder/busy_results" --dead "$folder/busy_dead" --expected 8 >/dev/null
count_step "another worker completes the message of a worker that ended after a signal" documents each_once "$folder/busy" "$folder/busy_results" "$folder/busy_dead"
cat "$first_log" "$worker_log" >"$folder/busy_log"
count_step "no photo of this message is converted twice" documents have_events "$folder/busy_log" photo 8
stop_worker TERM "$worker"

# A queue that refuses results: the worker keeps the message and publishes the documents of its converted photos again.
start_worker full full "$folder/photos" "$folder/outputs"
wait_until 20 health_is "$worker_address" 200
control_broker set_policy full '^full[.]results$' '{"max-length": 1, "overflow": "reject-publish"}' --apply-to queues
printf '%s\n' a.jpg b.jpg c.jpg | queue full submit --job f --photos-per-message 1
count_step "a worker logs that a queue refuses results" wait_until 60 grep -q '"publishing failed"' "$worker_log"
sleep 6 # until the next attempt, which the queue also refuses
control_broker clear_policy full
queue full collect --results "$folder/full_results" --dead "$folder/full_dead" --expected 3 >/dev/null
count_step "once the queue accepts results, every photo has one" documents codes_are "$folder/full_dead"
count_step "a photo whose result the queue refused is not converted again" documents have_events "$worker_log" photo 3
count_step "a message whose results the queue refused is not delivered again" documents none_came_again "$worker_log"
stop_worker TERM "$worker"
