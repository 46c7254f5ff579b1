"""How well people that the package did not draw are tracked: `python benchmarks/rendered_people/measure.py FOLDER`.

FOLDER holds what record.py wrote; names of people after it choose some. Each trial is tracked without pictures into
FOLDER/NAME/run, in place of an earlier run, and compared with the true joints. A line for each person, and its rows.
Half a minute to a minute each.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from airborne.io.environment import set_up_libraries

set_up_libraries()  # as the command line does: with other threads, last digits differ

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rows import append

from airborne.evaluation import compare_joints, read_joint_paths
from airborne.evaluation.joints import JointComparison
from airborne.motion.run_folder import read_body_run
from airborne.run.track import track_trial
from airborne.trial.file import read_trial


def track(folder: Path) -> JointComparison:
    """Track the trial in a person's folder and compare it with the truth there."""
    track_trial(read_trial(folder / "trial.toml"), folder / "run", overwrite=True, pictures=False)
    return compare_joints(*read_body_run(folder / "run"), read_joint_paths(folder / "truth_joints.csv"))


def describe(name: str, found: JointComparison) -> str:
    """Return one line about a person."""
    whole = found.whole
    return (
        f"person {name}: mean error {whole.mean_mm:.1f} mm, without constant offsets "
        f"{whole.mean_without_offset_mm:.1f} mm, largest {whole.largest_mm:.0f} mm; "
        f"{found.share_tracked:.0%} of joints tracked, {found.n_far} of them more than 100 mm off"
    )


def rows_of(name: str, found: JointComparison) -> list[dict]:
    """Return the rows of one person."""
    whole = found.whole
    common = {"data": f"rendered person {name}", "method": "refined", "n": whole.n}
    return [
        {**common, "metric": "mean joint error", "unit": "mm", "value": whole.mean_mm},
        {**common, "metric": "the same without constant offsets", "unit": "mm", "value": whole.mean_without_offset_mm},
        {**common, "metric": "largest joint error", "unit": "mm", "value": whole.largest_mm},
        {**common, "metric": "joints tracked", "unit": "", "value": found.share_tracked},
        {**common, "metric": "of them more than 100 mm off", "unit": "", "value": found.n_far},
        {**common, "metric": "held by the 95 % interval", "unit": "",
         "value": found.coverage_with_offset.within_95, "floor": "0.88..0.99"},
    ]  # fmt: skip


def main() -> None:
    """Measure the people named on the command line, or all that the folder holds."""
    parser = argparse.ArgumentParser(description="Track recordings of record.py and compare them with the truth.")
    parser.add_argument("folder", type=Path, help="what record.py wrote")
    parser.add_argument("names", nargs="*", metavar="name", help="of people there; without, all")
    args = parser.parse_args()
    there = sorted((path.parent.name for path in args.folder.glob("*/trial.toml")), key=lambda name: (len(name), name))
    if not there or (unknown := set(args.names) - set(there)):
        missing = ", ".join(sorted(unknown)) if there else "recordings"
        parser.error(f"no {missing} in {args.folder}; write them with record.py")
    for name in args.names or there:
        found = track(args.folder / name)
        print(describe(name, found), flush=True)
        append("rendered_people", rows_of(name, found))


if __name__ == "__main__":
    main()
