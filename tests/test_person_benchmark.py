"""The benchmark of a person's joints in its quick form: errors of a centimetre, held by their intervals."""

from benchmarks.accuracy.person_reliability import compare_synthetic, rows_of


def test_quick_form_measures_errors_and_their_intervals():
    rows = {row["metric"]: row["value"] for row in rows_of("synthetic somersault", "refined", compare_synthetic(3))}
    assert rows["mean joint error"] < 20
    assert rows["of them more than 100 mm off"] == 0
    assert 0.5 < rows["held by the 95 % interval"] <= 1
    assert 0 <= rows["ECE"] <= 0.5
