"""`import airborne` in scripts and notebooks: quick to open, and every snippet that is shown runs."""

import ast
import doctest
import inspect
import json
import re
import shutil
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest

import airborne as ab
from airborne import interface
from airborne.run import result
from tests.support.example_trial import bundle_light_cross, light_cross
from tests.support.places import ROOT, THROWN_CROSS

pytestmark = pytest.mark.usefixtures("_plain_figures")

PAGE = ROOT / "docs" / "reference" / "python.md"
STUDY = ROOT / "examples" / "study.ipynb"
SIXTEEN = '"stop": 16'  # fields of the study; fewer are as good here
HEAVY = ("cv2", "matplotlib", "nicegui", "numba", "numpy", "pydantic", "rich", "scipy", "xarray")


def snippets():
    """The page's Python blocks."""
    return re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def cells():
    """The notebook's code cells."""
    cells = json.loads(STUDY.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


@pytest.fixture(scope="module", autouse=True)
def _light_example():
    with pytest.MonkeyPatch.context() as patch:
        bundle_light_cross(patch)
        yield


def run_all(blocks, where):
    """Run blocks one after the other in one namespace, and return it."""
    names = {}
    for block in blocks:
        exec(compile(block, str(where), "exec"), names)
    return names


def test_the_package_opens_at_once():
    code = f"import sys, airborne; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


def test_every_public_name_is_there_and_says_what_it_is():
    assert set(ab.__all__) <= set(dir(ab))
    for name in ab.__all__:
        assert (inspect.getdoc(getattr(ab, name)) or "").strip(), name
    with pytest.raises(AttributeError, match="no attribute 'measure'"):
        ab.measure  # noqa: B018


def test_types_are_those_that_are_loaded():
    tree = ast.parse(inspect.getsource(ab))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    homes = {alias.name: node.module for node in imports if "airborne." in node.module for alias in node.names}
    assert set(homes) == set(ab.__all__)
    for name, home in homes.items():
        assert getattr(ab, name) is getattr(sys.modules[home], name)


@pytest.mark.parametrize("text", [PAGE.read_text(encoding="utf-8"), ab.__doc__], ids=["page", "help"])
def test_every_public_name_is_shown(text):
    assert [name for name in ab.__all__ if not re.search(rf"\b{name}\b", text)] == []


def test_the_page_uses_every_public_name():
    used = set(re.findall(r"\bab\.(\w+)", "".join(snippets())))
    assert used | {"Run"} == set(ab.__all__)  # a Run is what track returns


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder in which the page's snippets ran, and the names that they left."""
    folder = tmp_path_factory.mktemp("page")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        mpl.use("Agg")
        return folder, run_all(snippets(), PAGE)


def test_the_page_runs_from_top_to_bottom(done):
    folder, names = done
    assert names["compared"].position.rms_3d_mm < 3.0
    assert np.isfinite(names["velocity"]).any()
    assert isinstance(names["run"], ab.Run)
    assert (folder / "pose.png").stat().st_size > 10_000
    assert (folder / "results" / "export" / "results.c3d").is_file()


def test_what_a_run_holds_is_shown_in_a_line(done):
    run = ab.read_run(done[0] / "results")
    assert repr(run.motion) == "<Motion: 12 frames, 12 tracked, 0 uncertain, 0 lost>"
    assert repr(run.body) == "<BodyModel 'wooden cross': 1 segment, 6 degrees of freedom>"
    assert repr(run.rig) == "<Rig: cam1, cam2, cam3>"
    assert re.fullmatch(r"<Camera 'cam1': 768×576 px, focal length 10\d\d.\d px, at .* m>", repr(run.rig.cameras[0]))


def test_repeated_runs_agree_in_python_as_by_the_command(done, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("results", "in-code"):
        shutil.copytree(done[0] / name, name)
    found = ab.evaluate("results", repeats="in-code")
    assert list(found) == ["agreement"] and "between runs" in found["agreement"].describe()
    assert (tmp_path / "results" / "tables" / "repeatability.csv").is_file()


def test_examples_of_docstrings_run(done, tmp_path, monkeypatch):
    folder, _ = done
    shutil.copytree(light_cross(), tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    trial = tmp_path / "trial.toml"
    trial.write_text(trial.read_text(encoding="utf-8") + "stop = 5\n", encoding="utf-8")
    shutil.copytree(folder / "in-code", "results")
    functions = {name: getattr(interface, name) for name in interface.__all__}
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for name, thing in {**functions, "Run": ab.Run}.items():
        tests = finder.find(thing, name, globs=functions | vars(result))
        assert sum(len(test.examples) for test in tests), f"{name} shows no example"
        for test in tests:
            assert runner.run(test).failed == 0, name


def test_the_study_runs_from_top_to_bottom(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    assert SIXTEEN in "".join(cells())
    names = run_all([each.replace(SIXTEEN, '"stop": 6') for each in cells()], STUDY)
    assert (tmp_path / "results" / "report.html").is_file()
    assert all(path.is_file() for path in names["exported"].files)


def test_the_study_holds_no_outputs():
    notebook = json.loads(STUDY.read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert [cell for cell in code if cell["outputs"] or cell["execution_count"] is not None] == []


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (lambda: ab.synthesise("banana", "p"), "scene 'banana' is not known; choose cross or somersault or block"),
        (
            lambda: ab.synthesise("block", "p", difficulty="cruel"),
            "difficulty 'cruel' is not known; choose easy or default",
        ),
        (lambda: ab.read_trial(ab.example_trial("thrown_cross"), cameras=[1]), "= [1]; expected a list of names"),
        (lambda: ab.example_trial(None), "there is no example 'None'"),
        (lambda: ab.synthesise("cross", "p", sed=3), "synthesise has no option sed; it has: preset"),
        (lambda: ab.smooth("results", "butterwort"), "choose butterworth or spline or kalman"),
        (lambda: ab.smooth("results", "butterworth", cutoff_hz="auto"), "cutoff_hz is 'auto'; expected Hz, or None"),
        (lambda: ab.track(ab.example_trial("thrown_cross"), "trial.toml"), "trial.toml is a file; give a folder"),
        (lambda: ab.track(ab.example_trial("thrown_cross"), "trial.toml/p"), "trial.toml is a file; give a folder"),
        (
            lambda: ab.track(ab.example_trial("thrown_cross"), "/proc/p"),
            "/proc/p: No such file or directory; give a path",
        ),
        (lambda: ab.track(ab.example_trial("thrown_cross"), "results"), "give resume=True, overwrite=True or another"),
        (lambda: ab.synthesise("cross", "trial.toml/p"), "trial.toml is a file; give a folder"),
        (lambda: ab.smooth("results", output="trial.toml/p"), "trial.toml is a file; give a folder"),
        (lambda: ab.export_run("results", "trc", output="trial.toml"), "trial.toml is a file; give a folder"),
        (lambda: ab.example_trial("thrown_cros"), "there is no example 'thrown_cros'; there are: thrown_cross"),
        (lambda: ab.read_run("results").plot("banana"), "choose pose or joints or joint_status or flight"),
        (lambda: ab.Trial(name="x", camera=[]), "Trial: camera: holds 0 values, expected 1"),
        (lambda: ab.Trial(name="x", camera=[]), "; calibration is missing; body is missing"),
        (lambda: ab.Trial(name="x", camera={"name": "a"}), "camera: found one table, expected a list of tables; write"),
        (lambda: ab.read_rig(THROWN_CROSS / "control_points.csv"), "in Python calibrate with it"),
        (lambda: ab.read_rig("calib.toml")["cam1"].px_from_world([0, 1]), "expected (..., 3)"),
        (lambda: ab.read_rig("calib.toml").points_from_px([0, 1]), "expected (..., 3, 2), a row a camera"),
        (lambda: ab.read_trial("trial.toml", stopp=3), "stopp = 3: unknown key; did you mean stop?"),
        (lambda: ab.evaluate("results"), "give truth, digitised, joints"),
        (lambda: ab.synthesise("cross", "p", seed=-1), "seed is -1; expected a whole number, 0 or more"),
        (lambda: ab.synthesise("cross", "p", seed="a"), "seed is 'a'; expected a whole number"),
        (lambda: ab.smooth("results", events_s="none"), "events_s is 'none'; expected times in seconds"),
        (lambda: ab.read_run(5), "expected a path, as text or a Path (found int 5)"),
        (lambda: ab.read_trial(3), "expected a path"),
        (lambda: ab.track(None, "p"), "expected a path"),
        (lambda: ab.evaluate("results", np.zeros(3)), "expected a path, as text or a Path (found ndarray"),
        (lambda: ab.write_rig("c.toml", ab.read_rig("calib.toml")["cam1"]), "write_rig writes a Rig (found <Camera"),
        (lambda: ab.read_rig("calib.toml").select("cam1"), "select takes a list of names; give ['cam1']"),
    ],
)
def test_what_a_user_can_correct_is_said_in_one_line_of_python(mistake, said, done, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("results", "calib.toml"):
        (tmp_path / name).symlink_to(done[0] / name)
    shutil.copyfile(THROWN_CROSS / "trial.toml", "trial.toml")
    with pytest.raises(ab.AirborneError) as caught:
        mistake()
    assert said in str(caught.value)
    assert not any(word in str(caught.value) for word in ("--", "http"))
    assert not (tmp_path / "p").exists()
