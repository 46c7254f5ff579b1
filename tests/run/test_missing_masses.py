"""Of a body without masses it is said that no centre of mass and no angular momentum are measured."""

from dataclasses import replace

from airborne.body import human18
from airborne.run.body_tables import missing_masses
from tests.support.scenes import CROSS


def test_a_body_with_joints_that_lacks_masses_is_named_and_no_other():
    person = human18()
    without = replace(person, segments=tuple(replace(each, inertia=None) for each in person.segments))
    (warning,) = missing_masses(without)
    assert warning.startswith("the body has no mass of its segments, so that there is no flight.csv")
    part = (replace(person.segments[0], inertia=None), *person.segments[1:])
    assert "no mass of pelvis," in missing_masses(replace(person, segments=part))[0]
    assert missing_masses(person) == missing_masses(CROSS) == []
