"""A preset becomes the person of the first frames: nearer to their girths, in their clothes."""

from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from airborne.body import ATHLETE, SAMPLED, human18
from airborne.body_fitting.first_frames import fit_preset
from airborne.run import body, preset_shape
from airborne.run.body import BodyRun
from airborne.tracking.estimate import Status, lost_estimate
from airborne.tracking.image_regions import reduce_frames
from airborne.tracking.methods import Settings
from tests.body_fitting.test_fit import GIRTHS, MASS_KG, STATURE_M, axes, moving, person
from tests.support.scenes import CAMERAS, Scene

GIVEN, POSE = human18(STATURE_M, MASS_KG, outfit=SAMPLED), moving(Fraction(0))
DRESSED = human18(STATURE_M, MASS_KG, outfit=ATHLETE)


SCENE = Scene(model=person(), motion=moving, cameras=CAMERAS[:3], reach=0.3)
SEGMENTS = [name if name in ("torso", "chest") else f"{name}_left" for name in GIRTHS]


@pytest.fixture(scope="module")
def frames():
    return SCENE.frames(0)


def girths_off(model):
    """The mean distance of the girths from the person's, as a share."""
    return np.abs(np.log([axes(model, name)[:2] / axes(person(), name)[:2] for name in SEGMENTS])).mean()


def test_girths_come_nearer_and_the_mass_stays(frames):
    model = fit_preset(GIVEN, [(frames, POSE)], mass_kg=MASS_KG)
    assert model is not None
    assert girths_off(model) < 0.6 * girths_off(GIVEN)
    assert not model.needs_colours
    assert sum(segment.inertia.mass_kg for segment in model.segments) == pytest.approx(MASS_KG)


def test_body_too_small_to_show_its_parts_is_not_fitted(frames):
    small = reduce_frames(frames, GIVEN.with_pose(POSE), 20.0)
    assert fit_preset(GIVEN, [(small, POSE)], mass_kg=MASS_KG) is None


@dataclass
class Clip:
    """The frames of a recording, the first one at `start`."""

    start: int = 0
    stop: int | None = 1  # the body is fitted in frames after it, too

    def __iter__(self):
        return (SCENE.frames(index) for index in range(12 if self.stop is None else self.stop))


def test_person_who_is_uncertain_in_the_first_frame_is_fitted_in_those_after(monkeypatch):
    def track(tracker, frames, write):
        for each in frames:
            status, pose = Status.TRACKED if each.index else Status.UNCERTAIN, moving(each.time_s)
            yield each, replace(lost_estimate(each.index, each.time_s), status=status, pose=pose)

    monkeypatch.setattr(preset_shape, "track_frames", track)
    monkeypatch.setattr(body, "keys_of_frames", lambda trial, model, recording: ({9: model}, []))
    trial = SimpleNamespace(body=SimpleNamespace(is_preset=True, mass_kg=MASS_KG), settings=Settings())
    run = BodyRun(trial, Clip(), None, DRESSED, POSE)._fit_shape(SCENE.frames(0))
    assert girths_off(run.model) < 0.5 * girths_off(DRESSED)
    assert run.start is POSE
    with_key = BodyRun(trial, Clip(), None, DRESSED, POSE, keys={9: DRESSED})._fit_shape(SCENE.frames(0))
    assert girths_off(with_key.model) == girths_off(run.model)  # a key that is added later changes no body
    assert with_key.keys == {9: with_key.model}  # it is read anew, for the lengths of this one
