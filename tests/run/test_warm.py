"""After `airborne warm` the first run compiles nothing."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import product

from airborne.appearance import light_planes
from airborne.appearance.brightness import _count_ratios
from airborne.motion.smoothing import kalman
from airborne.run import warm
from airborne.run.warm import read_images, smooth_a_path
from airborne.video import crops
from tests.support.commands import in_process
from tests.support.example_trial import LONG, copy_cross, edit_trial

AIRBORNE = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"


def test_what_was_warmed_compiles_nothing(tmp_path, capsys, monkeypatch):
    """That processes can share the work is seen where a fresh clone is tested: its kernels are warmed first."""
    monkeypatch.setattr(warm, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    assert in_process("warm") == 0
    assert "kernels are ready" in capsys.readouterr().out
    folder = copy_cross(tmp_path / "trial")
    short = edit_trial(folder / "trial.toml", "short.toml", ("[track]", f"[track]\nstop = {LONG}"))
    words = ["track", str(short), "-o", str(tmp_path / "run"), "--no-pictures"]
    done = subprocess.run([sys.executable, "-c", AIRBORNE, *words], capture_output=True, text=True, check=True)
    assert done.stdout and "compiling" not in done.stderr


def test_whole_images_and_parts_are_read_as_all_types_that_occur():
    read_images()
    smooth_a_path()
    planes = {(str(image.dtype), image.layout) for image, *_ in light_planes.signatures}
    assert planes >= set(product(("uint8", "float32"), "AC"))
    assert {(image.layout, known.layout) for image, known, *_ in _count_ratios.signatures} >= set(product("AC", "AC"))
    assert all(kernel.signatures for kernel in (crops._convert, kalman._filter_kernel))
