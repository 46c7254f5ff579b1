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


def refusal(capsys, *arguments) -> str:
    """Return the one line on stderr of a command that must refuse."""
    capsys.readouterr()
    assert in_process(*arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1, err
    assert err.startswith("airborne: ")
    assert "Traceback" not in err
    return err
