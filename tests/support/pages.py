"""Pages of the documentation that are done step by step."""

import re
import shlex
import shutil

from typer.testing import CliRunner

from airborne.cli import app
from tests.support.places import ROOT

# a fenced block: the file that the line before it names, if any, the language, the text
STEPS = re.compile(r"(?:`([\w./-]+)`[^`\n]*:\n\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def run(line):
    """Run one line of a shell block: a copy, or a command of ours."""
    program, *words = shlex.split(line)
    if program == "cp":
        shutil.copytree(ROOT / words[1], words[2])
        return ""
    assert program == "airborne", line
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output
