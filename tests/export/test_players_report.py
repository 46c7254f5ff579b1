"""The report of a run of players: jumps to quote with their intervals, and nothing where nothing is known."""

from html import unescape

import numpy as np

from airborne.export.page import UNKNOWN_TEXT
from airborne.export.players_notes import jump_notes, players_warnings
from airborne.export.players_report import players_summary, write_players_report
from airborne.motion import measure_jumps
from airborne.motion.jumps.table import jump_row
from tests.support import jumping
from tests.support.browser import open_file

COUNTS = {
    **{"n_tracked": 150, "n_uncertain": 0, "n_lost": 0, "n_fewer_cameras": 0, "n_below_two_cameras": 0},
    **{"median_sd_mm": 1.7, "median_score": None},
}


def summary_of(jumps) -> dict:
    """What summary.json holds of a run with these rows of jumps."""
    return {
        **{"name": "a jump", "n_frames": 150, "n_tracked": 150, "n_uncertain": 0, "n_lost": 0},
        **{"start_s": 0.0, "duration_s": 2.5, "rate_hz": 60.0, "players": {"one": COUNTS}, "jumps": jumps},
        **{"uncertainty": "", "warnings": [], "method": {"method": "blocker"}},
    }


def test_a_jump_is_quoted_by_its_hips_with_its_interval_and_other_heights_follow(tmp_path):
    motion = jumping.motion_of(jumping.Jumper())
    (jump,) = measure_jumps(motion)
    summary = summary_of([jump_row(jump)])
    hips = jump.hip_height_m
    quoted = f"{100 * hips.value:.1f} ({100 * hips.low:.1f} to {100 * hips.high:.1f}) cm"
    counted, first, others = players_summary(summary)
    assert counted == "one: 150 tracked, 0 uncertain, 0 lost; median sd of a joint 2 mm"
    assert first == f"one, jump 1: {quoted}, hips over standing (95 % interval)"
    assert [name in others for name in ("feet", "flight time", "take-off speed")] == [True] * 3
    page = write_players_report(tmp_path, summary, motion).read_text(encoding="utf-8")
    assert f"<b>{quoted}</b><span>one, jump 1: hips</span>" in page
    flight = jump.flight_s
    assert f"{1000 * flight.value:.0f} ({1000 * flight.low:.0f} to {1000 * flight.high:.0f})" in page


def test_a_height_that_nobody_saw_is_unknown_and_it_is_said_why(tmp_path):
    motion = jumping.motion_of(jumping.Jumper())
    (jump,) = measure_jumps(motion)
    row = {**jump_row(jump), "hip_height_m": np.nan}
    _, first, _, note = players_summary(summary_of([row]))
    assert first == f"one, jump 1: {UNKNOWN_TEXT}, hips over standing (95 % interval)"
    why = "a peak needs five known frames around it, in each of which two cameras or more see the tracked player"
    assert note == f"  how high the hips rose is not known: {why}"
    page = write_players_report(tmp_path, summary_of([row]), motion).read_text()
    assert f"<b>{UNKNOWN_TEXT}</b>" in page and f"one, jump 1: how high the hips rose is not known: {why}</li>" in page


def test_uncertain_ankles_do_not_speak_against_the_height_of_hips_that_are_tracked():
    row = jump_row(measure_jumps(jumping.motion_of(jumping.Jumper()))[0])
    assert list(jump_notes(row)) == []
    (of_ankles,) = jump_notes({**row, "n_uncertain": 26})
    assert of_ankles.startswith("knees or ankles are uncertain in 26 of its frames, hips in none")
    (of_hips,) = jump_notes({**row, "n_uncertain": 26, "n_hips_uncertain": 3})
    assert of_hips == "hips are uncertain in 3 of its frames: check them before use"


def test_standing_that_was_not_seen_is_said_with_what_to_film():
    row = jump_row(measure_jumps(jumping.motion_of(jumping.Jumper()))[0])
    (note,) = jump_notes({**row, "standing_source": "lengths"})
    assert note.startswith("standing was not seen") and "film 0.25 s of standing upright and still within 5 s" in note


def test_legs_that_went_astray_are_said_beside_the_height_that_they_cost():
    row = jump_row(measure_jumps(jumping.motion_of(jumping.Jumper()))[0])
    _, note = jump_notes({**row, "noise_scale": 10.3, "tuck_m": 0.67, "foot_height_m": np.nan})
    assert note.startswith("its feet rose 0.67 m more than its hips") and "withheld" in note


def test_a_run_without_a_jump_says_so_and_one_of_a_single_frame_does_not():
    summary = summary_of([])
    assert list(players_summary(summary))[1:] == ["no jump was found"]
    assert len(list(players_summary({**summary, "n_frames": 1}))) == 1


def test_what_speaks_against_a_run_is_said_beside_its_numbers_and_in_the_same_words_among_its_warnings(tmp_path):
    motion = jumping.motion_of(jumping.Jumper())
    (jump,) = measure_jumps(motion)
    summary = summary_of([{**jump_row(jump), "noise_scale": 9.0}])
    doubts = ["all joints in frames 0 to 149: sd over 6 cm"]
    few = {"n_below_two_cameras": 90, "n_fewer_cameras": 90, "doubts": doubts}
    summary["players"] = {"one": {**COUNTS, "n_tracked": 0, "n_uncertain": 150, **few}}
    _, uncertain, few, untracked, unseen, _, _, noisy = players_summary(summary)
    assert uncertain == "  uncertain: all joints in frames 0 to 149: sd over 6 cm; check them before use"
    assert few == "  90 of 150 frames rest on fewer than two cameras, so that depth is a guess"
    assert untracked.startswith("  no frame was tracked, so none of these numbers can be relied on: are the joints of ")
    assert unseen.startswith("  in most frames fewer than two cameras agree: are videos exchanged")
    assert noisy.startswith("  its flight differs from a fall at 9.81 m/s² 3.0 times as much as stated errors explain")
    of_some = {**summary["players"]["one"], "doubts": ["ankles in frame 9: sd over 6 cm"]}
    assert list(players_summary({**summary, "players": {"one": of_some}}))[3] == (
        "  no frame was tracked, so none of these numbers can be relied on: in each some joint is uncertain, as said "
        "above"
    )
    warnings = list(players_warnings(summary))
    of_player = [f"one: {line.strip()}" for line in (uncertain, few, untracked, unseen)]
    assert warnings == [*of_player, f"one, jump 1: {noisy.strip()}"]
    page = write_players_report(tmp_path, {**summary, "warnings": warnings}, motion).read_text(encoding="utf-8")
    first, tables = unescape(page).split("<h2>Jumps</h2>")
    assert all(f"{each}</li>" in first for each in warnings)  # to be read first
    assert f"{warnings[-1]}</li>" in tables  # below the row


def test_its_viewer_shows_one_frame_in_a_browser(tmp_path):
    motion = jumping.motion_of(jumping.Jumper())
    (jump,) = measure_jumps(motion)
    write_players_report(tmp_path, summary_of([jump_row(jump)]), motion)
    with open_file(tmp_path / "report.html") as page:
        view, solid = page.locator("#viewer"), page.locator(".in-3d")
        assert view.get_attribute("data-frame") == str(motion.index[0])
        before = solid.screenshot()
        page.locator("#viewer .at").fill("70")  # in the air
        assert view.get_attribute("data-frame") == str(motion.index[70])
        assert f"frame {motion.index[70]}, {motion.time_s[70]:.3f} s" in page.locator(".now").inner_text()
        assert solid.screenshot() != before
