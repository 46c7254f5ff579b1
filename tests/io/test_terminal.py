"""Progress of long work as lines."""

from airborne.io import terminal


def test_more_than_was_expected_raises_what_is_expected(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "_SECONDS_BEFORE", 0.0)
    monkeypatch.setattr(terminal, "_SECONDS_A_LINE", 0.0)
    with terminal.Stages() as stages:
        stages("tracking", 34, 34)
        stages("tracking", 35, 34)
        stages("tracking", 36, None)
    assert capsys.readouterr().err.splitlines() == ["tracking: 34 of 34", "tracking: 35 of 35", "tracking: 36"]
