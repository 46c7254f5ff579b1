"""`airborne bench` times what it says: every method on every field of the example."""

from airborne.run import bench
from tests.support.example_trial import bundle_light_cross


def test_median_mean_and_percentile_are_those_of_the_fields(monkeypatch):
    monkeypatch.setattr(bench, "_tracking_ms", lambda method: [1.0] * 19 + [41.0])
    monkeypatch.setattr(bench, "_scoring_us", lambda: 7.0)
    speed = bench.measure_speed()
    for method in ("refined", "stepping", "simplex"):
        assert speed[f"{method}_ms_per_field"] == 1
        assert speed[f"{method}_mean_ms_per_field"] == 3
        assert 1 < speed[f"{method}_95th_percentile_ms_per_field"] < 41
    assert speed["score_us_per_hypothesis"] == 7


def test_every_field_is_timed_and_so_is_a_hypothesis(monkeypatch):
    bundle_light_cross(monkeypatch)
    times_ms = bench._tracking_ms("refined")
    assert len(times_ms) == 34 and min(times_ms) > 0
    assert 0 < bench._scoring_us(20, 2) < 1e3 * max(times_ms)
