#!/bin/sh
# with_status.sh COMMAND...: runs a command and prints its exit status in the last line. CTest recognizes skipped tests by their output, and
# would otherwise ignore a later failure, such as a leak that the sanitizer finds at exit.
"$@"
status=$?
echo "exit status $status"
exit $status
