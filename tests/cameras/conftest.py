"""The bundled trial's control points and their calibration, found once."""

import pytest

from airborne.cameras import Calibration, ControlPoints, calibrate, read_control_points


@pytest.fixture(scope="session")
def points(thrown_cross) -> ControlPoints:
    return read_control_points(thrown_cross / "control_points.csv")


@pytest.fixture(scope="session")
def sizes(points) -> dict[str, tuple[int, int]]:
    return dict.fromkeys(points.cameras, (768, 576))


@pytest.fixture(scope="session")
def calibration(points, sizes) -> Calibration:
    return calibrate(points, sizes)
