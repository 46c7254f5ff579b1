"""The method, the last frame and the folder of the next run, chosen in the step Track; in a real browser."""

import shutil

from airborne.io.text import read_toml
from airborne.trial.settings import PLAYERS_METHODS
from tests.support.browser import open_page
from tests.support.example_trial import edit_trial
from tests.support.places import THROWN_CROSS
from tests.support.players_trial import write_run, write_trial
from tests.support.studio import fork_studio, wait_for_frame, wait_until

N, LAST = 6, 3


def test_method_and_last_frame_are_written_into_the_trial_and_undone(tmp_path):
    trial = write_trial(tmp_path / "block", N, track=f'method = "{PLAYERS_METHODS[0]}"  # a note')
    with fork_studio(trial) as address, open_page(address.replace("/?", "/track?")) as page:
        wait_for_frame(page, 0)
        method, last = page.get_by_label("method"), page.get_by_label("last frame")
        assert (method.input_value(), last.input_value()) == (PLAYERS_METHODS[0], str(N - 1))
        method.click()
        page.get_by_role("option").first.wait_for()
        assert page.get_by_role("option").all_text_contents() == list(PLAYERS_METHODS)
        page.get_by_role("option", name=PLAYERS_METHODS[1], exact=True).click()
        last.fill(str(N))
        last.press("Enter")
        page.get_by_text(f"the last frame of all videos is {N - 1}; {N} lies after it").wait_for()
        last.fill(str(LAST))
        last.press("Enter")
        wait_until(page, lambda: len(read_toml(trial)["track"]) == 2)  # what is typed in is not set anew meanwhile
        assert read_toml(trial)["track"] == {"method": PLAYERS_METHODS[1], "stop": LAST + 1}
        page.locator("canvas.view").press("Control+z")
        page.wait_for_function("n => document.querySelector('[aria-label=\"last frame\"]').value == n", arg=str(N - 1))
        page.locator("canvas.view").press("Control+z")
        page.get_by_text(f"undone: method {PLAYERS_METHODS[1]}").first.wait_for()
        assert method.input_value() == PLAYERS_METHODS[0]
    assert read_toml(trial)["track"] == {"method": PLAYERS_METHODS[0]}
    assert "# a note" in trial.read_text()


def test_a_run_is_kept_unless_it_is_to_be_replaced_and_a_name_is_refused_not_altered(tmp_path):
    trial = write_trial(tmp_path / "block", N)
    write_run(trial.parent / "results", N)
    before = (trial.parent / "results" / "joints.csv").read_bytes()
    with fork_studio(trial) as address, open_page(address.replace("/?", "/track?")) as page:
        wait_for_frame(page, 0)
        again, name = page.get_by_role("button", name="Track again"), page.get_by_label("folder of the run")
        name.fill("../x")
        page.get_by_text('"../x" cannot be the folder of a run; give a name of').wait_for()
        again.wait_for(state="hidden")
        name.fill("results")
        again.click()
        page.get_by_role("button", name="Cancel").click()
        page.get_by_role("dialog").wait_for(state="detached")
        again.click()
        page.get_by_role("button", name="Keep it, track into results_2").click()
        page.wait_for_function("() => document.querySelector('[aria-label=\"folder of the run\"]').disabled")
        assert name.input_value() == "results_2"
        page.get_by_role("progressbar", name="progress").wait_for()
        page.get_by_role("button", name="Stop", exact=True).click()
        page.wait_for_function("() => !document.querySelector('[aria-label=\"folder of the run\"]').disabled")
        page.get_by_role("progressbar", name="progress").wait_for(state="hidden")
    assert (trial.parent / "results" / "joints.csv").read_bytes() == before


def test_a_page_goes_on_once_what_comes_first_is_done_and_frames_before_the_first_pose_are_taken_back(tmp_path):
    folder = shutil.copytree(THROWN_CROSS, tmp_path / "cross")
    trial = edit_trial(folder / "trial.toml", "trial.toml", ("frame = 0", "frame = 20"))
    points = folder / "control_points.csv"
    text = points.read_text()
    points.write_text(text.replace("5", "five", 1))
    with fork_studio(trial) as address, open_page(address.replace("/?", "/track?")) as page:
        page.get_by_text("First comes Cameras: see the steps at the left.").wait_for()
        assert "is not a number" in page.locator(".rail .says").nth(1).get_attribute("title")
        points.write_text(text)
        page.get_by_label("last frame").wait_for()
        first = page.get_by_label("first frame")
        first.fill("21")
        first.press("Enter")
        page.get_by_text("the first pose is that of frame 20; give a first frame up to there").wait_for()
        first.fill("5")
        first.press("Enter")
        page.get_by_text("from frame 20, the first pose's, on and back").wait_for()
        assert read_toml(trial)["track"] == {"method": "refined", "start": 5}
        first.fill("")
        first.press("Enter")
        page.get_by_text("from frame 20, the first pose's", exact=True).wait_for()
        assert first.input_value() == "20"
    assert read_toml(trial)["track"] == {"method": "refined"}


def test_what_tracking_ended_with_stays_and_nothing_is_chosen_while_it_goes_on(tmp_path):
    trial = write_trial(tmp_path / "block", N)
    (trial.parent / "results").mkdir()
    (trial.parent / "results" / "mine.txt").touch()
    reason = "results is not empty and holds no run; give a new or empty folder"
    with fork_studio(trial) as address, open_page(address.replace("/?", "/track?")) as page:
        wait_for_frame(page, 0)
        page.get_by_role("button", name="Track", exact=True).click()
        page.get_by_role("button", name="Stop").wait_for()
        method = page.locator(".q-select.q-field--disabled", has_text="method")
        method.wait_for()
        assert page.get_by_label("last frame").is_disabled()
        page.locator(".warn", has_text=reason).wait_for()
        method.wait_for(state="detached")
        page.reload()  # also to whom it was not told
        page.locator(".warn", has_text=reason).wait_for()
