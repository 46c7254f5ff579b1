"""What the findings of a self-check say together."""

import pytest

from airborne.run.self_check import alarms


def finding(subject, value, *, is_alarm=True):
    return {"subject": subject, "kind": "scale", "value": value, "is_alarm": is_alarm, "sentence": f"the {subject} ..."}


@pytest.mark.parametrize(
    ("body", "world", "said"), [(0.232, 0.234, "10 % too low"), (-0.17, -0.175, "10 % too high"), (0.1, -0.1, None)]
)
def test_a_body_and_a_world_that_are_wrong_alike_tell_of_the_frame_rate(body, world, said):
    found = alarms([finding("body", body), finding("world", world)])
    assert found[:2] == ["self-check: the body ...", "self-check: the world ..."]
    assert found[2:] == ([] if said is None else [f"self-check: a frame rate {said} would explain both"])
    assert len(alarms([finding("body", body), finding("world", world, is_alarm=False)])) == 1


def test_a_camera_whose_time_is_wrong_comes_with_its_remedy_and_one_that_may_be_right_with_none():
    late = {**finding("cam3", 0.05), "kind": "time_s", "sentence": "camera cam3 seems 50.2 ± 8.4 ms late"}
    (said,) = alarms([late])
    assert said == "self-check: camera cam3 seems 50.2 ± 8.4 ms late: run `airborne sync`, then track again"
    assert alarms([{**late, "is_alarm": False}]) == []
