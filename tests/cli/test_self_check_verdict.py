"""What the self-check is surer of than three deviations is named as wrong, however small it is."""

import re

import pytest

from airborne.cli.track import _describe_self_check
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


@pytest.mark.parametrize(("n_tracked", "said"), [(0, "0 of 9 frames are tracked"), (1, "1 of 9 frames is tracked")])
def test_of_a_run_that_is_mostly_untracked_nothing_is_called_right(n_tracked, said):
    finding = {"is_alarm": False, "sentence": "the body looks as large as it is"}
    summary = {"n_frames": 9, "n_tracked": n_tracked, "n_lost": 1, "self_check": [finding]}
    verdict = _describe_self_check(summary)
    assert said in verdict and "too few" in verdict
    assert "nothing seems wrong" in _describe_self_check(summary | {"n_tracked": 5})
    assert "something is wrong" in _describe_self_check(summary | {"self_check": [finding | {"is_alarm": True}]})
