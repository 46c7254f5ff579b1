"""The guided walk says something at every step, and goes on where a step is done; `--demo` opens it."""

from airborne.studio.guide import next_task
from airborne.studio.project import find_trial, read_project, steps
from tests.support.browser import open_page
from tests.support.studio import open_studio


def test_the_walk_goes_from_step_to_step(tmp_path):
    project = read_project(*find_trial(tmp_path))
    names = [step.name for step in steps(project)]
    assert [next_task(project, name)[1] for name in names if name != "Digitise"] == [None] * (len(names) - 1)
    assert next_task(project, "Digitise")[1].name == "Results"
    (tmp_path / "a.mp4").write_bytes(b"video")
    (tmp_path / "trial.toml").write_text('[[camera]]\nname = "a"\nvideo = "a.mp4"\n')
    task, following = next_task(read_project(*find_trial(tmp_path)), "Videos")
    assert "Use these cameras" in task
    assert "Use this thing" in next_task(project, "Body", "thing")[0] != next_task(project, "Body")[0]
    assert following.name == "Cameras"


def test_the_demo_walks_through_a_copy_of_the_example(tmp_path):
    """In the process that a user starts, not in a fork of one."""
    with open_studio(tmp_path / "any", "--demo") as address, open_page(address) as page:
        page.get_by_text("Three cameras filmed a wooden cross that was thrown.").wait_for()
        page.get_by_role("button", name="Use these cameras").click()
        page.get_by_role("link", name="Next: Cameras").click()
        page.get_by_text("as surveyed points: their clicks are in it").wait_for()
    copied = {path.name for path in (tmp_path / "airborne-studio-demo").iterdir() if path.is_file()}
    assert copied == {"cam1.mp4", "cam2.mp4", "cam3.mp4", "control_points.csv", "cross.toml", "trial.toml"}
