"""The guided walk of `airborne studio --demo`: what to do at each step with the thrown cross."""

from __future__ import annotations

from airborne.studio.project import Project, StudioStep, steps

_TO_DO = {
    "Videos": "Three cameras filmed a wooden cross that was thrown. Their files are ticked, and interlaced: two fields "
    "in each picture, which doubles the images. Press <b>Use these cameras</b>.",
    "Cameras": "Points of known places hung in the scene. Choose <b>control_points.csv</b> as surveyed points: their "
    "clicks are in it, and each camera is solved at once. Drag one and watch its residual.",
    "Body": "The cross was measured. Choose <b>cross.toml</b> as body file, and press <b>Use this body</b>.",
    "First pose": "Press <b>Find it</b>, wait, check that the outline lies on the cross in all three "
    "pictures, and press <b>Use this pose</b>.",
    "Track": "Press <b>Track</b> and watch the outline follow the cross.",
    "Review": "Step with the arrow keys through the throw: pictures, curves and the scene go together.",
    "Digitise": "Here a person clicks points, to compare a run with. The report does not need them: go to Results.",
    "Results": "Open the report: one file, to send or to print. That was the walk; now open a folder of your own.",
}
_BESIDE = {
    "sync": "The three cameras of the cross share one clock: there is nothing to do here. Go back to Videos.",
    "thing": "The cross is described already, in <b>cross.toml</b>: go back to Body. Another thing is described "
    "here by its solids; <b>Use this thing</b> puts it in the cross's place.",
    "ruler": "Measure the cross if you like: its long bar is 0.900 m. Then go back to Body.",
}


def next_task(project: Project, here: str, page: str = "") -> tuple[str, StudioStep | None]:
    """Return what is to be done at a step of the walk, as HTML, and where it goes on once that is done.

    `page` is one beside the step's own.
    """
    way = steps(project)
    own = next(number for number, step in enumerate(way) if step.name == here)
    is_done = way[own].state == "ready" or here == "Digitise"
    following = way[own + 1] if is_done and own + 1 < len(way) else None
    return _BESIDE.get(page, _TO_DO[here]), following
