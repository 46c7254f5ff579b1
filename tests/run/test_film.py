"""A film of a stretch: as many pictures as frames, the cameras side by side over the curves."""

import shutil
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image as GifPicture

from airborne.cameras import Rig, camera_looking_at
from airborne.errors import ResultError
from airborne.run.film import _open, write_film
from airborne.video import VideoSource, VideoWriter, inspect
from airborne.video.image_index import index_images
from airborne.video.seeking import ImageReader
from tests.run.test_find import cli
from tests.support.person_run import write_person_run

SIZE, N, RATE = (320, 240), 12, Fraction(50)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run whose overlay videos grow brighter with every frame, in the second camera faster."""
    run = tmp_path_factory.mktemp("film") / "results"
    places = {"a": [3.0, -4.0, 1.5], "b": [-4.0, -3.0, 1.2]}
    rig = Rig(tuple(camera_looking_at(n, p, [0, 0, 1.1], focal_px=300, size=SIZE) for n, p in places.items()))
    write_person_run(run, rig, N, RATE)
    (run / "videos").mkdir()
    for name, step in (("a", 5), ("b", 15)):
        with VideoWriter(run / "videos" / f"overlay_{name}.mp4", size=SIZE, rate=RATE) as writer:
            for k in range(N):
                writer.write(np.full((SIZE[1], SIZE[0], 3), 20 + step * k, np.uint8))
    return run


def test_a_stretch_shows_its_frames_and_a_cursor_over_the_curves(run, tmp_path):
    assert write_film(run, tmp_path / "film.mp4", first=3, last=8) == (3, 8)
    source = VideoSource("film", tmp_path / "film.mp4")
    assert inspect(source).frame_rate == RATE
    with ImageReader(source, index_images(source)) as reader:
        assert len(reader.index) == 6
        images = [reader.image(k).astype(int) for k in range(6)]
    for k, image in enumerate(images):
        assert image.shape[1] == 2 * SIZE[0] and image.shape[0] > SIZE[1]
        middles = [image[120, x].mean() for x in (160, 480)]
        np.testing.assert_allclose(middles, [20 + 5 * (3 + k), 20 + 15 * (3 + k)], atol=4)
        below = image[SIZE[1] + 4 :].sum(axis=2).mean(axis=0)
        assert abs(int(np.argmin(below)) - k / 5 * (image.shape[1] - 1)) <= 3


def test_a_stretch_that_goes_beyond_the_run_ends_with_it(run, tmp_path, monkeypatch, capsys):
    assert cli(monkeypatch, "film", run, "--first", 9, "--last", 99, "-o", tmp_path / "end.mp4") == 0
    assert capsys.readouterr().out.strip() == f"{tmp_path / 'end.mp4'}: frames 9 to {N - 1}"


def test_a_gif_leaves_pictures_out_that_browsers_would_slow_down(run, tmp_path):
    calls = []
    write_film(run, tmp_path / "film.gif", progress=lambda *said: calls.append(said))
    assert calls == [(k, N) for k in range(1, N + 1)]
    with GifPicture.open(tmp_path / "film.gif") as film:
        assert (film.n_frames, film.info["duration"]) == (N // 2, 40)


@pytest.mark.parametrize(
    ("name", "frames", "said"),
    [
        ("film.avi", {}, "films are .mp4 or .gif"),
        ("film.mp4", {"first": 40}, "has frames 0 to 11, and 40 is after 11"),
        ("film.mp4", {"first": 20, "last": 5}, "frames 20 to 5: the first frame must come before the last"),
    ],
)
def test_what_cannot_be_filmed_is_one_line(run, tmp_path, name, frames, said):
    with pytest.raises(ResultError, match=said):
        write_film(run, tmp_path / name, **frames)


@pytest.mark.parametrize(
    ("is_finished", "said"),
    [(True, r"do not hold the run's 12 frames; track again"), (False, "run is not finished; finish it with")],
)
def test_pictures_of_fewer_frames_are_named_with_what_to_do(run, tmp_path, monkeypatch, is_finished, said):
    folder = shutil.copytree(run, tmp_path / "run")
    if is_finished:
        (folder / "summary.json").write_text("{}")
    monkeypatch.setattr("airborne.run.film.index_images", lambda source: range(N - 1))
    monkeypatch.setattr("airborne.run.film.ImageReader", lambda source, index: SimpleNamespace(index=index))
    with pytest.raises(ResultError, match=said):
        _open(folder, N)


def test_a_run_without_pictures_says_so(run, tmp_path):
    (tmp_path / "bare").mkdir()
    for name in ("motion.csv", "covariance.bin", "body.toml", "calib.toml"):
        (tmp_path / "bare" / name).write_bytes((run / name).read_bytes())
    with pytest.raises(ResultError, match="has no videos of overlays; track again without"):
        write_film(tmp_path / "bare", tmp_path / "film.mp4")
