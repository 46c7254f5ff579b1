"""A camera that a board or wand fits much worse than the others is named."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from airborne.calibration.diagnosis.results import _check_objects
from tests.support.calibration_scenes import three_side_by_side

RIG = three_side_by_side()


def calibration(rms_px, name="board", *, is_object=True) -> Any:
    adjustment = SimpleNamespace(
        sources=[SimpleNamespace(name=name, is_object=is_object)],
        rms_px=lambda *, source, camera: np.array(rms_px)[camera],
    )
    return SimpleNamespace(adjustment=adjustment, rig=RIG)


@pytest.mark.parametrize("name", ["board", "wand"])
def test_a_camera_of_other_moments_is_named(name):
    (found,) = _check_objects(calibration([0.7, 9.6, 1.1], name))
    assert found.cameras == (RIG.names[1],)
    assert f"the {name} fits to 9.6 px only, usual are 1.1 px" in found.what and "airborne sync" in found.advice


@pytest.mark.parametrize("rms_px", [[0.7, 3.5, 1.1], [5.0, 9.0, 5.0], [np.nan, np.nan, np.nan], [0.5, np.nan, 0.5]])
def test_nothing_is_said_of_errors_that_are_small_or_everywhere(rms_px):
    assert not list(_check_objects(calibration(rms_px)))


def test_nothing_is_said_of_clicked_points_here():
    assert not list(_check_objects(calibration([0.7, 9.6, 1.1], "court", is_object=False)))
