"""A frame rate that is too low for jumps, and one that is not that of the video."""

import re
from dataclasses import replace

import pytest

from airborne.motion.jumps.heights import describe_slow_falls, measure_jumps
from tests.support.jumping import G, Jumper, motion_of

CLEAN = Jumper()


def test_too_few_frames_a_second_measure_no_jump():
    assert len(measure_jumps(motion_of(Jumper(rate=30.0)))) == 1
    assert measure_jumps(replace(motion_of(Jumper(rate=20.0)), rate=20.0)) == ()


@pytest.mark.parametrize("share", [0.4, 0.5, 1.0])
def test_a_jump_filmed_at_more_images_than_stated_is_said_to_fall_slowly(share):
    motion = motion_of(CLEAN)
    slow = replace(motion, time_s=motion.time_s / share)
    said = describe_slow_falls(slow)
    assert (len(measure_jumps(slow)), len(said)) == ((1, 0) if share == 1 else (0, 1))
    if said:
        found = re.search(r"falls at (.*) m/s², not at 9\.81.* is (.*) times that at which", said[0])
        assert [float(each) for each in found.groups()] == pytest.approx([G * share**2, share], rel=0.1)
