"""Commands of ours, run in the process of the tests."""

import sys

from airborne import cli


def in_process(*arguments) -> int:
    """Run a command as its entry point does, and return the exit code."""
    before, sys.argv = sys.argv, ["airborne", *map(str, arguments)]
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = before
    return 0
