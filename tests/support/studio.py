"""The studio as a process, and its pages in a browser."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO

import numpy as np

from airborne.cli import main
from airborne.io.folder_lock import LOCK
from airborne.studio import field_order
from airborne.studio.prefetch import Prefetch
from airborne.studio.writing import FOLDER
from tests.support.forked_commands import FORKS, fork_commands

RUN = "import sys; sys.argv[0] = 'airborne'; from airborne.cli import main; main()"
_NAME = "MainProcess"  # of a process in which NiceGUI serves
CLICK_SD_PX = 1.0  # of a user's clicks, right and down
N_BITS, BLOCK_PX = 10, 24  # of numbers burnt into pictures


@contextmanager
def open_studio(path: Path, *options: str) -> Iterator[str]:
    """Start the studio of a folder or trial; yield its address, with the token."""
    command = [sys.executable, "-c", RUN, "studio", str(path), "--no-browser", *options]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    env = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}  # NiceGUI looks at it
    with subprocess.Popen(command, cwd=path.parent, env=env, **pipes) as process:
        try:
            yield _address(process.stdout, process.stderr)
        finally:
            process.terminate()
            said = process.communicate(timeout=30)[1]
    assert "Traceback" not in said, said


@contextmanager
def fork_studio(path: Path, *options: str, before: Callable[[], None] | None = None) -> Iterator[str]:
    """Do what `open_studio` does, in a fifth of its time: in a fork of a process that has imported everything.

    So are the commands that it starts. It makes no pictures that nobody asks for, and looks at few to show the order of
    fields. `before`, a function of a module, is called there first.
    """
    (ours, out), (ours_of_errors, errors) = (FORKS.Pipe(duplex=False) for _ in range(2))
    words = ("studio", str(path), "--no-browser", *options)
    process = FORKS.Process(target=_run_command, args=(words, path.parent, out, errors, before), name=_NAME)
    process.start()
    out.close(), errors.close()
    with open(ours.fileno(), closefd=False) as printed, open(ours_of_errors.fileno(), closefd=False) as complained:
        try:
            yield _address(printed, complained)
        finally:
            process.terminate()
            said = complained.read()
            process.join(timeout=30)
    assert "Traceback" not in said, said


def kill_studio(folder: Path) -> None:
    """Kill the studio that has a folder open, as a crash does."""
    holder = (folder / FOLDER / LOCK).read_text()
    os.kill(int(re.search(r"process (\d+)", holder)[1]), signal.SIGKILL)


def _address(printed: IO[str], complained: IO[str]) -> str:
    line = printed.readline()
    found = re.search(r"http://\S+", line)
    assert found, line + complained.read()
    return found.group(0)


def _run_command(
    words: tuple[str, ...], folder: Path, out: Connection, errors: Connection, before: Callable[[], None] | None
) -> None:
    for number, pipe in enumerate((out, errors), start=1):
        os.dup2(pipe.fileno(), number)
    os.chdir(folder)
    os.environ.pop("PYTEST_CURRENT_TEST", None)  # NiceGUI looks at it
    Prefetch.start, field_order._N_LOOKED_AT = (lambda prefetch: None), 2
    fork_commands()
    if before is not None:
        before()
    sys.argv = ["airborne", *words]
    main()


def go_home(page) -> None:
    """Go to the first frame: a page opens where the last one was."""
    page.locator("canvas.view").press("Home")
    wait_for_frame(page, 0)


def wait_for_frame(page, frame: int) -> None:
    """Wait until the pictures show a frame."""
    page.wait_for_function("frame => document.querySelector('canvas.view')?.dataset.frame == frame", arg=str(frame))


def wait_until(page, is_so: Callable[[], bool]) -> None:
    """Wait until something holds that the page does not show; fail after a minute: machines are busy."""
    for _ in range(1200):
        if is_so():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it did not come to hold within a minute")


def wait_for_still_scene(page) -> int:
    """Wait until the 3D scene is no longer drawn; return how often it was."""
    script = """async () => {
        const canvas = document.querySelector("canvas:not(.view)");
        const scene = getElement(Number(canvas.closest("[id^=c]").id.slice(1)));
        const drawn = () => scene.renderer.info.render.frame;
        for (let before = -1; drawn() !== before; ) {
            before = drawn();
            await new Promise((done) => setTimeout(done, 500));
        }
        return drawn();
    }"""
    page.wait_for_selector("canvas:not(.view)", state="attached")
    return page.evaluate(script)


def at_pixel(page, pane: int, u: float, v: float) -> tuple[float, float]:
    """Return where on the page a pixel of a camera's picture is."""
    script = """([pane, u, v]) => {
        const { view } = document.querySelector("canvas.view"), box = view.box();
        const [x, y] = view.toScreen(view.layout()[pane], u, v);
        return [box.left + view.zoom() * x, box.top + view.zoom() * y];
    }"""
    return tuple(page.evaluate(script, [pane, u, v]))


def read_number(page, pane: int) -> int:
    """Read the number that is burnt into a camera's picture, off the canvas."""
    script = """([pane, places]) => {
        const canvas = document.querySelector("canvas.view"), view = canvas.view;
        const pens = canvas.getContext("2d"), ratio = window.devicePixelRatio;
        return places.map(([u, v]) => {
            const [x, y] = view.toScreen(view.layout()[pane], u, v);
            return pens.getImageData(Math.round(x * ratio), Math.round(y * ratio), 1, 1).data[1];
        });
    }"""
    levels = page.evaluate(script, [pane, [bit_place(bit) for bit in range(N_BITS)]])
    return sum(int(level > 127) << bit for bit, level in enumerate(levels))


def bit_place(bit: int) -> list[float]:
    """Return the middle of a bit's block in a picture that carries its number [px]."""
    return [BLOCK_PX * (bit + 1) - 0.5, 1.5 * BLOCK_PX + 40]


def burn_numbers(n: int, size: tuple[int, int] = (320, 240)) -> list[np.ndarray]:
    """Return grey pictures that carry their number as black and white blocks."""
    width, height = size
    images = []
    for number in range(n):
        image = np.full((height, width, 3), 90, np.uint8)
        for bit in range(N_BITS):
            u, v = bit_place(bit)
            left, top, half = round(u + 0.5), round(v), BLOCK_PX // 2
            image[top - half : top + half, left - half : left + half] = 235 if number >> bit & 1 else 20
        images.append(image)
    return images


class User:
    """Someone at the page, whose clicks are counted."""

    def __init__(self, page):
        self.page, self.clicks, self.rng = page, 0, np.random.default_rng(3)

    def click(self, found):
        found.first.click()
        self.clicks += 1

    def go(self, step):
        self.click(self.page.locator("nav a", has=self.page.get_by_text(step, exact=True)))

    def press(self, button):
        self.click(self.page.get_by_role("button", name=button, exact=True))

    def click_pixel(self, pane, px):
        u, v = px + CLICK_SD_PX * self.rng.standard_normal(2)
        self.page.mouse.click(*at_pixel(self.page, pane, u, v))
        self.clicks += 1

    def choose_point(self, name):
        """Press N until a point of the list is chosen."""
        script = "before => document.querySelector('.point.here')?.firstElementChild.textContent !== before"
        while (chosen := self.page.locator(".point.here").first.locator("div").first.text_content()) != name:
            self.page.keyboard.press("n")
            self.page.wait_for_function(script, arg=chosen)
