"""A mass that no person of that stature or volume has is named, in pounds where that would do."""

import pytest

from airborne.body import human18
from airborne.body.density import density_kg_per_l, doubt_build, doubt_mass
from airborne.body.shaping import with_mass, with_size
from tests.support.scenes import CROSS


@pytest.mark.parametrize(("stature_m", "mass_kg"), [(1.5, 40.0), (1.74, 70.0), (1.9, 110.0)])
def test_people_by_stature_and_mass_are_taken_without_a_word(stature_m, mass_kg):
    assert [*doubt_build(stature_m, mass_kg), *doubt_mass(human18(stature_m, mass_kg))] == []


def test_pounds_are_named_where_they_would_be_a_persons():
    (doubt,) = doubt_build(1.74, 154.0)
    assert doubt.endswith("expected 14 to 40: check mass_kg and stature_m; were it in pounds, it would be 69.9 kg")
    (doubt,) = doubt_build(1.74, 40.0)
    assert "pounds" not in doubt
    (doubt,) = doubt_mass(with_mass(human18(1.74, 70.0), 154.0))
    assert doubt.startswith("body: 154.0 kg are 1.94 kg a litre") and doubt.endswith("it would be 69.9 kg")


def test_the_density_stays_with_the_size_and_goes_with_the_mass():
    person = human18(1.74, 70.0)
    density = density_kg_per_l(person)
    assert density_kg_per_l(with_size(person, 1.1)) == pytest.approx(density)
    assert density_kg_per_l(with_mass(person, 84.0)) == pytest.approx(1.2 * density)
    (doubt,) = doubt_mass(with_mass(with_size(person, 1.1), 70.0))
    assert "the mass is too small, or the body too large" in doubt


def test_of_another_body_nothing_is_said():
    assert density_kg_per_l(CROSS) is None and list(doubt_mass(CROSS)) == []
