"""Images that are not as the user says, and images that are, from few points and many."""

from dataclasses import replace

import numpy as np
import pytest

from airborne.calibration.from_points import calibrate
from airborne.calibration.sources.control_points import ControlPoints
from airborne.cameras import Rig
from tests.support.cameras import clicked, scattered, three_cameras

SIZE = (768, 576)


def click(rig: Rig, n: int, seed: int = 0, noise_px: float = 1.0) -> ControlPoints:
    """Return n points as a careful hand clicks them."""
    world = scattered(n, seed) * [1.5, 1.5, 1.0]
    exact = np.stack([camera.px_from_world(world) for camera in rig], axis=1)
    px = exact + np.random.default_rng(seed).normal(0, noise_px, exact.shape)
    names = tuple(f"P{k}" for k in range(n))
    return ControlPoints(names=names, world=world, cameras=rig.names, px=px)


def kinds_of(points: ControlPoints, size: tuple[int, int]) -> list[str]:
    return [finding.kind for finding in calibrate(points, dict.fromkeys(points.cameras, size)).findings]


@pytest.mark.parametrize(("n", "seed"), [(9, 0), (9, 1), (9, 2), (20, 0), (20, 1)])
def test_images_as_the_user_says_are_not_doubted(n, seed):
    assert not {"off centre", "squeezed"} & {*kinds_of(click(three_cameras(), n, seed), SIZE)}


@pytest.mark.parametrize(("size", "likely"), [((768, 768), (768, 576)), ((1024, 768), (768, 576))])
def test_a_size_that_is_wrong_for_all_cameras_is_found_once_and_the_right_one_named(size, likely):
    points = click(three_cameras(), 20)
    [finding] = calibrate(points, dict.fromkeys(points.cameras, size)).findings
    assert finding.kind == "off centre"
    assert finding.cameras == points.cameras
    width, height = map(int, finding.what.split("about ")[-1].split("×"))
    assert np.allclose((width, height), likely, rtol=0.05)
    assert f"is {size[0]}×{size[1]} their size" in finding.advice


def test_one_camera_of_its_own_shift_does_not_speak_for_all():
    rig = three_cameras()
    points = click(rig, 20)
    shifted = clicked(points, rig.names[0], lambda px: np.add(px, [0, 96]))  # a crop of one camera alone
    findings = calibrate(shifted, dict.fromkeys(points.cameras, (768, 768))).findings
    assert not [finding for finding in findings if len(finding.cameras) > 1]


def test_cameras_of_one_size_that_is_wrong_are_told_from_those_of_another():
    rig = three_cameras()
    sizes = dict(zip(rig.names, [SIZE, (1024, 768), (1024, 768)], strict=True))
    [finding] = calibrate(click(rig, 20), sizes).findings
    assert finding.cameras == rig.names[1:]


def test_nine_points_are_too_few_to_doubt_an_image_and_say_so(points, sizes):
    first = np.isin(points.names, [f"P0{k}" for k in range(1, 10)])
    findings = calibrate(replace(points, px=np.where(first[:, None, None], points.px, np.nan)), sizes).findings
    assert {finding.kind for finding in findings} == {"few"}
    assert findings[0].sentence.endswith(
        "too few to tell whether its image size is right: click more, 15 to 25 are good"
    )


def test_a_wrong_size_is_told_from_many_points_of_one_camera(points):
    [finding] = calibrate(replace(points, cameras=("cam1",), px=points.px[:, :1]), {"cam1": (1536, 1152)}).findings
    assert "expected near the middle (768, 576)" in finding.what
