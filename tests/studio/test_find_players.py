"""Players who are looked for: the answer of `airborne find`, drawn and written; in a real browser where nobody is."""

import json

import numpy as np

from airborne.run.players_tracker import player_starts
from airborne.studio.outlines import legs_items
from airborne.studio.trial_edits import with_players
from airborne.trial.file import read_trial
from tests.studio.test_click_players import LEGS, TRIAL, folder, rig, two_cameras, write_block  # noqa: F401
from tests.support.browser import open_page
from tests.support.studio import User, fork_studio, wait_for_frame


def test_the_players_of_an_answer_are_those_of_the_trial(rig, folder):  # noqa: F811
    beside = {name: [x + 1.0, y, z] for name, (x, y, z) in LEGS.items()}
    found = json.loads(json.dumps({"player1": LEGS, "player2": beside}))
    text = with_players(TRIAL + 'body = { preset = "legs" }\n', 2, {k: {"joints_m": v} for k, v in found.items()})
    (folder / "found.toml").write_text(text)
    trial = read_trial(folder / "found.toml")
    assert trial.start.frame == 2 and not trial.start.find
    for start, legs in zip(player_starts(trial, rig), (LEGS, beside), strict=True):
        np.testing.assert_array_equal([start.joints_m[name] for name in LEGS], list(legs.values()))


def test_legs_are_lines_down_each_side_in_every_camera(rig):  # noqa: F811
    items = legs_items("anna", LEGS, tuple(rig), "#fff")
    assert [item["pane"] for item in items] == [0, 1, 0, 1]
    assert [item["text"] for item in items] == ["anna", "anna", "", ""]
    left = [LEGS[f"{limb}_left"] for limb in ("hip", "knee", "ankle")]
    np.testing.assert_allclose(items[0]["points"], next(iter(rig)).px_from_world(np.array(left)), atol=0.006)


def test_where_nobody_stands_the_studio_says_so_and_clicks_are_a_button_away(tmp_path):
    block = write_block(tmp_path / "block", two_cameras(160), 1)  # large pictures take long to be looked through
    (block / "trial.toml").write_text(TRIAL + 'body = { preset = "legs" }\n')
    with fork_studio(block) as address, open_page(address.replace("/?", "/start?")) as page:
        user = User(page)
        wait_for_frame(page, 0)
        user.press("Find automatically")
        user.press("Find it")
        page.get_by_text("no player is seen to stand at the net", exact=False).wait_for()
        user.press("Click the points")
        page.get_by_text("No player is ready to use yet.").wait_for()
