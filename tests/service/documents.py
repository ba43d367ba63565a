"""Checks, for tests/service/run.sh, of the files that workers and the collector wrote.

    documents.py FUNCTION [ARGUMENT...]     exits with 0 if the check FUNCTION passes
"""
import json
import os
import sys

from prometheus_client.parser import text_string_to_metric_families


def lines(path):
    """Returns the complete lines of a file that may still grow."""
    return [json.loads(line) for line in open(path) if line.endswith("\n")] if os.path.exists(path) else []


def in_mid_message(log):
    """Whether the worker of this log has converted some but not all photos of its last message."""
    events = lines(log)
    begun = max((i for i, line in enumerate(events) if line["event"] == "message"), default=None)
    if begun is None:
        return False
    done = sum(line["event"] in ("photo", "already done") for line in events[begun:])
    return 0 < done < events[begun]["photos"]


def logs_are_structured(*logs):
    """Whether every line is an object with the time, the severity, the event and the process."""
    every = [line for log in logs for line in lines(log)]
    return bool(every) and all({"time", "level", "event", "process"} <= line.keys() for line in every)


def have_events(log, event, number):
    return sum(line["event"] == event for line in lines(log)) == int(number)


def was_given_out(times, *logs):
    """Whether this is the largest number of deliveries of a message with a single photo."""
    return max(line["earlier"] for log in logs for line in lines(log) if line["event"] == "message" and line["photos"] == 1) + 1 == int(times)


def some_came_again(*logs):
    """Whether one of these workers received a redelivered message."""
    return any(line["event"] == "message" and line["earlier"] > 0 for log in logs for line in lines(log))


def none_came_again(*logs):
    """Whether these workers received messages, none of them redelivered."""
    messages = [line for log in logs for line in lines(log) if line["event"] == "message"]
    return bool(messages) and not any(line["earlier"] > 0 for line in messages)


def each_once(keys, results, dead):
    """Whether every photo has exactly one line in the two files together."""
    every = [line["photo"] for path in (results, dead) for line in lines(path)]
    expected = open(keys).read().splitlines()
    print(f"{len(every)} documents of {len(expected)} photos, {len(lines(dead))} of them dead letters")
    return sorted(every) == sorted(expected)


def reasons(dead, broken):
    """Whether the dead letters are the photos of the file `broken`, with the same codes. A line of `broken` is a key, a tab, and a code."""
    found = {line["photo"]: line["error"] for line in lines(dead)}
    expected = dict(line.split("\t") for line in open(broken).read().splitlines())
    for code in sorted(set(expected.values())):
        print("   ", code, sum(error["code"] == code for error in found.values()), "such as:", next((e["message"] for e in found.values() if e["code"] == code), None))
    return {key: error["code"] for key, error in found.items()} == expected and all(not error["try_again"] and error["message"] for error in found.values())


def numbers_agree(results, dead, *metrics):
    """Whether Prometheus' parser reads the metrics, the counters equal the numbers of results, and the stages report their times."""
    total, stages = {}, set()
    for path in metrics:
        for family in text_string_to_metric_families(open(path).read()):
            for sample in family.samples:
                labels = {name: value for name, value in sample.labels.items() if name in ("outcome", "code")}
                key = (sample.name, *labels.values())
                if "le" not in sample.labels:
                    total[key] = total.get(key, 0) + sample.value
                if sample.name == "photo3d_stage_seconds_count":
                    stages.add(sample.labels["stage"])
    failures = {}
    for line in lines(dead):
        failures[line["error"]["code"]] = failures.get(line["error"]["code"], 0) + ("photo" in line)
    counted = {key[1]: value for key, value in total.items() if key[0] == "photo3d_failures_total"}
    print("   ", counted, sorted(stages))
    return (total["photo3d_photos_total", "converted"] == len(lines(results)) and total["photo3d_photos_total", "failed"] == sum(failures.values())
            and {code: n for code, n in counted.items() if n} == {code: n for code, n in failures.items() if n}
            and {"defect", "file access", "invalid data", "too large", "unavailable for now"} <= counted.keys()  # published with 0
            and total["photo3d_photo_seconds_count",] == len(lines(results)) + sum(failures.values())
            and total["photo3d_written_bytes_total",] == sum(line["bytes"] for line in lines(results))
            and {"getting photo", "reading photo", "encoding", "putting GLB"} < stages)


def codes_are(path, *codes):
    """Whether the errors have these codes, in any order."""
    return sorted(line["error"]["code"] for line in lines(path)) == sorted(codes)


sys.exit(not globals()[sys.argv[1]](*sys.argv[2:]))
