"""The guided walk says something at every step, and goes on where a step is done."""

from airborne.studio.guide import next_task
from airborne.studio.project import find_trial, read_project, steps


def test_the_walk_goes_from_step_to_step(tmp_path):
    project = read_project(*find_trial(tmp_path))
    names = [step.name for step in steps(project)]
    assert [next_task(project, name)[1] for name in names if name != "Digitise"] == [None] * (len(names) - 1)
    assert next_task(project, "Digitise")[1].name == "Results"
    (tmp_path / "a.mp4").write_bytes(b"video")
    (tmp_path / "trial.toml").write_text('[[camera]]\nname = "a"\nvideo = "a.mp4"\n')
    task, following = next_task(read_project(*find_trial(tmp_path)), "Videos")
    assert "Use these cameras" in task
    assert following.name == "Cameras"
