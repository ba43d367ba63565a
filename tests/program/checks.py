"""Counts checks, for tests written in Python."""
import sys

passed = failed = 0


def check(name, is_good, said=""):
    """Counts a check. If it failed, prints its name and `said`, the output of the tested program."""
    global passed, failed
    if is_good:
        passed += 1
    else:
        failed += 1
        print(f"FAILED {name} {said}".rstrip())


def finish():
    """Prints the counts and ends the test, with exit code 1 if a check failed."""
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)
