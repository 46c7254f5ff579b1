"""A recording whose cameras are all dark where tracking starts is refused, with its dark frames named."""

import numpy as np
import pytest

from airborne.errors import TrialError
from airborne.run.check import check_trial
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from tests.cli.test_cli import in_process
from tests.support.clips import write_clip
from tests.support.players_trial import pictures, stand_in, write_trial

DARK = "frames 2 to 3 are dark in all cameras"


def trial_with(folder, dark):
    """A trial of six pictures that starts at frame 2; the frames `dark` of the named cameras are black."""
    path = write_trial(folder, 6, start="frame = 2")
    for name, indices in dark.items():
        shown = [np.zeros_like(each) if k in indices else each for k, each in enumerate(pictures(6))]
        write_clip(folder / f"{name}.mkv", shown, codec="libx264", pix_fmt="yuv420p")
    return path


def test_it_is_refused_by_check_and_track(tmp_path, capsys, monkeypatch):
    stand_in(monkeypatch)
    path = trial_with(tmp_path / "trial", {"left": range(4), "right": range(4)})
    (mistake,) = check_trial(path).mistakes
    assert DARK in mistake and "start.frame" in mistake
    with pytest.raises(TrialError, match=DARK):
        track_trial(read_trial(path), tmp_path / "run", pictures=False)
    assert in_process("track", path, "-o", tmp_path / "other", "--no-pictures") == 2
    assert DARK in capsys.readouterr().err


@pytest.mark.parametrize("dark", [{"left": range(4)}, {"left": [0, 1, 3], "right": [0, 1, 3]}])
def test_one_camera_that_shows_the_start_is_enough(tmp_path, monkeypatch, dark):
    stand_in(monkeypatch)
    path = trial_with(tmp_path / "trial", dark)
    checks = check_trial(path)
    assert not any("dark" in mistake for mistake in checks.mistakes)
    assert any("images of left in frame 2 are black" in doubt for doubt in checks.doubts) == ("right" not in dark)
    assert len(track_trial(read_trial(path), tmp_path / "run", pictures=False).motion) == 4
