"""A video of which every second image is left out is a half as long as the others at its stated rate, and is named."""

from fractions import Fraction

import pytest

from airborne.run.opening import fewer_images, has_fewer_seconds_by_rate, other_rates
from airborne.video import VideoFacts

NAMES = ("a", "b", "c")


def facts(n_images, rate=60):
    return VideoFacts((1280, 720), Fraction(rate), Fraction(n_images, rate), "progressive", "progressive", 0)


@pytest.mark.parametrize(("n_images", "share", "rate"), [(37, 2, 30), (36, 2, 30), (25, 3, 20), (18, 4, 15)])
def test_a_video_with_a_part_of_the_images_is_named(n_images, share, rate):
    (note,) = fewer_images(NAMES, [facts(73), facts(n_images), facts(73)])
    assert note.startswith(f"b: its video lasts 1/{share} as long as most") and f"come at {rate} a second" in note


@pytest.mark.parametrize("n_images", [73, 80, 60, 45, 30, 5])
def test_of_other_lengths_and_of_other_rates_nothing_is_said(n_images):
    assert fewer_images(NAMES, [facts(73), facts(n_images), facts(73)]) == []
    assert fewer_images(NAMES, [facts(72), facts(36, 30), facts(72)]) == []


def test_a_video_at_another_rate_than_most_is_named_and_whether_that_must_be_wrong():
    (same,) = other_rates(NAMES, [facts(34, 50), facts(34, 60), facts(34, 50)])
    assert same.startswith("b: 60 images/s are stated, of other cameras 50") and "its rate is wrong" in same
    (mixed,) = other_rates(NAMES, [facts(50, 50), facts(60, 60), facts(50, 50)])
    assert mixed.startswith("b: 60 images/s are stated") and "its rate is wrong" not in mixed
    assert other_rates(NAMES, [facts(60, 60), facts(60, Fraction(60000, 1001)), facts(60, 60)]) == []
    assert has_fewer_seconds_by_rate(facts(34, 60), facts(34, 50))
    assert not has_fewer_seconds_by_rate(facts(30, 50), facts(34, 50))
