# Runs a RabbitMQ broker on a free port, with all its data in one folder. Scripts that need a broker source this file.
#
#   start_broker FOLDER    starts the broker, with the data in FOLDER if present; sets broker_url
#   stop_broker            ends the broker and keeps its data, as a restart of its machine would
#   remove_broker          ends the broker and the processes that Erlang leaves running

# shellcheck shell=bash disable=SC2034

# free_ports N: prints N free ports outside the range of ephemeral ports. A client that connects to an ephemeral port before the server
# listens there may be assigned the same port and connect to itself. Use it as <<<"$(free_ports N)", which waits until the ports are
# closed.
free_ports() {
    python3 -c 'import random, socket, sys
sockets = []
while len(sockets) < int(sys.argv[1]):
    try:
        sockets.append(socket.create_server(("127.0.0.1", random.randrange(10000, 30000))))
    except OSError:
        pass
print(*(s.getsockname()[1] for s in sockets))' "$1"
}

start_broker() {
    local folder=$1 waited=0
    if [ -z "${broker_port:-}" ]; then
        read -r broker_port broker_distribution_port broker_names_port <<<"$(free_ports 3)"
        mkdir -p "$folder"
        # Accepts connections only from this machine.
        printf '%s\n' "listeners.tcp.1 = 127.0.0.1:$broker_port" 'log.console = false' >"$folder/broker.conf"
        : >"$folder/environment"
        : >"$folder/plugins"
    fi
    broker_url=amqp://guest:guest@127.0.0.1:$broker_port
    # Debian's wrapper in the PATH would switch to another user and use the system's folders. RUNNING_UNDER_SYSTEMD makes the script
    # replace itself with the broker (exec), so that $! is the broker's process. Busy waiting is off, because the workers need the cores.
    env RUNNING_UNDER_SYSTEMD=1 RABBITMQ_SERVER_ADDITIONAL_ERL_ARGS="+sbwt none +sbwtdcpu none +sbwtdio none" HOME="$folder" ERL_EPMD_PORT="$broker_names_port" ERL_EPMD_ADDRESS=127.0.0.1 RABBITMQ_CONF_ENV_FILE="$folder/environment" \
        RABBITMQ_NODENAME="ldi-$broker_port@localhost" RABBITMQ_DIST_PORT="$broker_distribution_port" \
        RABBITMQ_CONFIG_FILE="$folder/broker.conf" RABBITMQ_ENABLED_PLUGINS_FILE="$folder/plugins" \
        RABBITMQ_MNESIA_BASE="$folder/data" RABBITMQ_LOG_BASE="$folder/log" \
        /usr/lib/rabbitmq/bin/rabbitmq-server >>"$folder/output" 2>&1 </dev/null &
    broker_process=$!
    until (exec 3<>"/dev/tcp/127.0.0.1/$broker_port") 2>/dev/null; do
        sleep 0.2
        waited=$((waited + 1))
        if [ "$waited" -gt 300 ] || ! kill -0 "$broker_process" 2>/dev/null; then
            printf 'The broker does not start:\n' >&2
            tail -n 20 "$folder/output" >&2
            return 1
        fi
    done
}

stop_broker() {
    kill -TERM "$broker_process" 2>/dev/null || true
    for _ in $(seq 100); do
        kill -0 "$broker_process" 2>/dev/null || break
        sleep 0.1
    done
    kill -KILL "$broker_process" 2>/dev/null || true
    wait "$broker_process" 2>/dev/null || true
}

remove_broker() {
    [ -n "${broker_process:-}" ] || return 0
    stop_broker
    ERL_EPMD_PORT=$broker_names_port epmd -kill >/dev/null 2>&1 || true
}
