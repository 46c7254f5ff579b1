from fractions import Fraction

import av
import numpy as np
import pytest

from airborne.errors import VideoError
from airborne.sync import offsets_by_sound
from airborne.video import VideoSource
from tests.support.clips import numbered, write_clip

RATE_HZ = 48000
PICTURE = np.full((48, 64, 3), 90, np.uint8)


def hall(seconds: float) -> np.ndarray:
    """Sound of a hall from 1 s before time 0 on: claps, squeaks and voices over noise."""
    rng = np.random.default_rng(4)
    t = np.arange(int((seconds + 2) * RATE_HZ)) / RATE_HZ
    sound = 0.003 * rng.standard_normal(len(t))
    for start in rng.uniform(0, seconds + 2, 14):
        along = np.maximum(t - start, 0)
        sound += (t > start) * rng.standard_normal(len(t)) * np.exp(-along / 0.02) * 0.3
        sound += (t > start) * np.sin(2 * np.pi * rng.uniform(400, 3000) * along) * np.exp(-along / 0.15) * 0.1
    return sound.astype(np.float32)


def film(
    path, late_s: float, *, seed: int = 0, seconds: float = 6.0, codec: str = "pcm_s16le", sound=None
) -> VideoSource:
    """A camera that starts late_s after time 0 and hears the hall, with its own noise and loudness."""
    sound = hall(8) if sound is None else sound
    rng = np.random.default_rng(seed)
    first = round((1 + late_s) * RATE_HZ)
    own = sound[first : first + round(seconds * RATE_HZ)] * rng.uniform(0.3, 1)
    own = own + 0.004 * rng.standard_normal(len(own)).astype(np.float32)
    with av.open(path, "w") as container:
        video = container.add_stream("ffv1", rate=Fraction(25))
        video.width, video.height, video.pix_fmt = 64, 48, "bgr0"
        audio = container.add_stream(codec, rate=RATE_HZ)
        audio.layout = "mono"
        for k in range(round(25 * seconds)):
            frame = av.VideoFrame.from_ndarray(PICTURE)
            frame.pts, frame.time_base = k, Fraction(1, 25)
            container.mux(video.encode(frame))
        container.mux(video.encode(None))
        samples = np.clip(own * 32767, -32768, 32767).astype(np.int16)
        resampler = av.AudioResampler(audio.codec_context.format, "mono", RATE_HZ)
        for begin in range(0, len(samples), 1024):
            frame = av.AudioFrame.from_ndarray(samples[None, begin : begin + 1024], format="s16", layout="mono")
            frame.sample_rate, frame.pts, frame.time_base = RATE_HZ, begin, Fraction(1, RATE_HZ)
            for part in resampler.resample(frame):
                container.mux(audio.encode(part))
        container.mux(audio.encode(None))
    return VideoSource(path.stem, path)


@pytest.mark.parametrize("late_s", [0.1234, -0.4567, 0.0])
def test_sound_brings_cameras_together_within_a_fraction_of_a_millisecond(tmp_path, late_s):
    found = offsets_by_sound([film(tmp_path / "a.mkv", 0.0), film(tmp_path / "b.mkv", late_s, seed=1)])
    assert abs(found.offset_s[1] - late_s) < 2e-4
    assert found.offset_sd_s[1] < 1e-3
    assert "3 ms a metre" in found.notes[0]


def test_how_far_the_microphones_are_apart_widens_the_sd(tmp_path):
    sources = [film(tmp_path / "a.mkv", 0.0), film(tmp_path / "b.mkv", 0.2, seed=1)]
    near, far = (offsets_by_sound(sources, microphones_apart_m=m) for m in (0.0, 10.0))
    assert far.offset_sd_s[1] == pytest.approx(np.hypot(near.offset_sd_s[1], 10 / 343 / np.sqrt(3)))
    assert far.notes == ()


def test_compressed_sound_does_as_well(tmp_path):
    sources = [film(tmp_path / "a.mkv", 0.0, codec="aac"), film(tmp_path / "b.mkv", 0.2, seed=1, codec="aac")]
    assert abs(offsets_by_sound(sources).offset_s[1] - 0.2) < 1e-3


def test_a_camera_without_sound_is_named(tmp_path):
    silent = VideoSource("silent", write_clip(tmp_path / "silent.mkv", numbered(5)))
    with pytest.raises(VideoError, match="has no sound"):
        offsets_by_sound([film(tmp_path / "a.mkv", 0.0), silent])


def test_sound_of_another_place_is_refused(tmp_path):
    other = np.random.default_rng(9).standard_normal(10 * RATE_HZ).astype(np.float32) * 0.05
    with pytest.raises(VideoError, match="b: its sound does not fit that of a"):
        offsets_by_sound([film(tmp_path / "a.mkv", 0.0), film(tmp_path / "b.mkv", 0.0, sound=other)])
