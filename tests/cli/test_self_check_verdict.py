"""What the self-check is surer of than three deviations is named as wrong, however small it is."""

import re

from tests.support.commands import in_process
from tests.support.example_trial import copy_cross


def test_a_body_that_is_a_little_too_large_is_not_called_right(tmp_path, capsys):
    trial = copy_cross(tmp_path / "trial") / "trial.toml"
    body = trial.with_name("cross.toml")

    def larger(match):
        numbers = ", ".join(f"{1.03 * float(x):.5f}" for x in match[2].split(","))
        return f"{match[1]} = [{numbers}]"

    text = re.sub(r"(size_m|centre_m) = \[([^\]]*)\]", larger, body.read_text(encoding="utf-8"))
    body.write_text(text, encoding="utf-8")
    assert in_process("track", trial, "-o", tmp_path / "run", "--no-pictures") == 0
    said = capsys.readouterr().out
    assert "something is wrong" in said
    assert re.search(r"the body looks 3\.\d ± 0\.\d % smaller than its model says", said)
