"""The page of a batch: its cells hold whole numbers, of turns with their standard deviation."""

from airborne.batch.table import write_outputs
from airborne.batch.task import TaskOutcome
from airborne.batch.trials import BatchTrial


def test_the_page_shows_turns_with_their_deviation_in_cells_that_do_not_break(tmp_path):
    row = {"somersault_rev": 0.54, "somersault_rev_sd": 0.0025, "twist_rev": -0.18, "twist_rev_sd": None, "n_alarms": 0}
    trial = BatchTrial(name="a", path=tmp_path / "trial.toml", labels={"athlete": "anna"})
    write_outputs(tmp_path, [trial], {"a": TaskOutcome("a", "done", "", row=row)})
    html = (tmp_path / "index.html").read_text("utf-8")
    assert '<td class="number" data-value="0.54">0.5400 ± 0.0025</td>' in html
    assert '<td class="number" data-value="-0.18">−0.18</td>' in html
    assert '<th scope="col">alarms</th>' in html and ".number { white-space: nowrap; }" in html
    assert '<td data-value="anna">anna</td>' in html
