"""While a trial is read and tracked, no room calls one above it, but for what was handed to it to be called."""

import sys
from pathlib import Path

import airborne
from airborne.run import mix_ups
from airborne.run.track import track_trial
from airborne.trial.file import read_trial
from tests.support.example_trial import light_cross
from tests.test_architecture import ORDER

SOURCE = Path(airborne.__file__).parent
TAKE_FUNCTIONS = {"geometry/descent.py", "geometry/even_sample.py", "tracking/tracker.py"}


def place_of(frame) -> tuple[str, str] | None:
    """The room and the file of a call; none for code that is not ours."""
    try:
        path = Path(frame.f_code.co_filename).relative_to(SOURCE)
    except ValueError:
        return None
    return (path.parts[0], path.as_posix()) if len(path.parts) > 1 else None


def calls_during(work) -> set[tuple[tuple[str, str], tuple[str, str]]]:
    """Who called whom between rooms, code of others left out in between."""
    calls = set()

    def note(frame, event, _):
        if event != "call" or (called := place_of(frame)) is None:
            return
        above = frame.f_back
        while above is not None and place_of(above) is None:
            above = above.f_back
        if above is not None and (caller := place_of(above))[0] != called[0]:
            calls.add((caller, called))

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return calls


def test_calls_go_down_the_rooms(tmp_path, monkeypatch):
    monkeypatch.setattr(mix_ups, "_foreground", mix_ups._foreground.__wrapped__)  # here, too, it is found
    trial = light_cross() / "trial.toml"
    calls = calls_during(lambda: track_trial(read_trial(trial, {"stop": 3}), tmp_path / "run", pictures=False))
    assert len({called[0] for _, called in calls}) > 10  # it was watched
    up = {caller[1] for caller, called in calls if ORDER.index(called[0]) > ORDER.index(caller[0])}
    assert up <= TAKE_FUNCTIONS
