"""The code keeps to its plan: imports go down the page, kernels know no nouns, files and functions stay short."""

import ast
import functools
import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest

import airborne

SOURCE = Path(__file__).resolve().parents[1] / "src" / "airborne"
ORDER = [
    "kernels",
    "io",
    "geometry",
    "cameras",
    "video",
    "calibration",
    "body",
    "rendering",
    "appearance",
    "tracking",
    "body_fitting",
    "motion",
    "evaluation",
    "export",
    "synthetic",
    "reproduction",
    "trial",
    "run",
    "sync",
    "batch",
    "study",
    "studio",
    "interface",
    "cli",
]  # a room may import what stands before it, and itself
OF_TRIALS = ("trial", "run", "body_fitting", "batch", "study", "interface", "cli")  # their files are imported by name
PACKAGES = [room for room in ORDER if room not in ("io", *OF_TRIALS)]
FOR_ALL = {"", "errors", "types", "constants"}  # the package's own name holds its version
NOUNS = ("cameras", "video", "body")  # packages whose public names are values with a meaning, not arrays
KERNELS = [
    "cameras/distortion.py",
    "calibration/bundle/loss.py",
    *sorted(f"geometry/{path.name}" for path in (SOURCE / "geometry").glob("[a-z]*.py")),
    *(
        f"motion/smoothing/{name}.py"
        for name in (
            "boundaries",
            "butterworth",
            "kalman",
            "propagation",
            "residuals",
            "rotations",
            "segments",
            "splines",
        )
    ),
    *(
        f"appearance/{name}.py"
        for name in ("background", "foreground", "hue_saturation", "lighting", "surface_classes")
    ),
    *(f"tracking/capsules/{name}.py" for name in ("evidence", "outlines", "spans")),
    *(
        f"tracking/particle/{name}.py"
        for name in (
            "bootstrap",
            "colour_classes",
            "distances",
            "jump_state",
            "occlusion",
            "resampling",
            "rods",
            "swing",
            "view_likelihood",
        )
    ),
    "tracking/direct_search/stepping.py",
]
MOST_LINES_A_FILE, MOST_LINES_A_FUNCTION = 300, 90
HEAVY = ("matplotlib", "nicegui", "tkinter", "PyQt5", "PySide6", "typer", "ezc3d", "yeadon")
IMPORT_LATE = "import it inside the function that needs it: python -X importtime tells who loads it now"
FILES = sorted(SOURCE.rglob("*.py"))
TEXTS = {path: path.read_text(encoding="utf-8") for path in FILES}


def name_of(path):
    return str(path.relative_to(SOURCE))


def layer_of(path):
    """The package that a file belongs to, or its own name at the top."""
    return path.relative_to(SOURCE).parts[0].removesuffix(".py").replace("__init__", "")


parse = functools.cache(ast.parse)  # of a source text, which nobody changes


@functools.cache
def imports_of(source):
    """Every module of airborne that a source text imports, as paths below it: ("body", "model")."""
    found = []
    for node in ast.walk(parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            assert node.level == 0, f"write airborne.… for the dots: {ast.unparse(node)}"
        else:
            continue
        found += [tuple(name.split(".")[1:]) for name in names if name.split(".")[0] == "airborne"]
    return found


def layers_of(source):
    return {(path or ("",))[0] for path in imports_of(source)}


def upward_arrows(layer, source):
    """What a module of a layer imports although it stands later in the order."""
    known = {*ORDER, *FOR_ALL}
    layers = {imported for imported in layers_of(source) if imported in known}
    return {imported for imported in layers - FOR_ALL if ORDER.index(imported) > ORDER.index(layer)}


def functions_of(source):
    """Every function and its length in lines without its docstring."""
    for node in ast.walk(parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            length = node.end_lineno - node.lineno + 1
            if ast.get_docstring(node) is not None:
                length -= node.body[0].end_lineno - node.body[0].lineno + 1
            yield node.name, length


def is_number(node):
    """Whether an expression is made of numbers alone: 3, (0.1, 2), np.radians(20), np.array([1, 2]), 1 / 480."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    parts = node.elts if isinstance(node, ast.Tuple | ast.List) else []
    if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1].islower():  # a class names its fields
        parts = node.args
    return bool(parts) and all(map(is_number, parts))


def numbers_without_a_word(source):
    """The module's numbers that have no comment on their lines or on the line above."""
    lines, tokens = source.splitlines(), tokenize.generate_tokens(io.StringIO(source).readline)
    comments = {token.start[0] for token in tokens if token.type == tokenize.COMMENT}
    comments |= {row + 1 for row in comments if lines[row - 1].startswith("#")}
    return [
        lines[node.lineno - 1]
        for node in parse(source).body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        and node.value is not None
        and is_number(node.value)
        and comments.isdisjoint(range(node.lineno, node.end_lineno + 1))
    ]


def test_arrows_are_told_apart():
    assert upward_arrows("body", "from airborne.tracking.loss import x\nimport airborne.cameras") == {"tracking"}
    assert upward_arrows("video", "from airborne import body, errors") == {"body"}
    assert upward_arrows("video", "def f():\n    import airborne.export.page") == {"export"}
    assert upward_arrows("export", "from airborne import __version__\nfrom airborne.errors import x") == set()


def test_every_module_has_its_place_in_the_order():
    layers = {layer_of(path) for path in FILES} - FOR_ALL
    assert layers <= set(ORDER), (
        "enter the room in ORDER here and in docs/explanation/architecture.md, or move the file"
    )
    assert layers >= set(PACKAGES), "take the room that is gone out of ORDER and of docs/explanation/architecture.md"


def offenders(law):
    """What `law` finds in every file by its path and text, where it finds anything."""
    found = {name_of(path): law(path, text) for path, text in TEXTS.items()}
    return {name: what for name, what in found.items() if what}


def test_imports_only_go_down_the_page():
    def climbs(path, text):
        if path == SOURCE / "__init__.py":
            return layers_of(text.split("if TYPE_CHECKING:")[0])  # the package loads nothing at first
        if layer_of(path) in FOR_ALL:
            return layers_of(text)  # errors, types and constants import nothing of the package
        return upward_arrows(layer_of(path), text)

    mend = "move what is imported down into a room that both may import, or pass its result on as an argument"
    assert offenders(climbs) == {}, mend


def test_no_room_imports_the_public_interface():
    public = {*airborne.__all__, "interface"}
    found = offenders(lambda path, text: {imported[0] for imported in imports_of(text) if imported} & public)
    may = {"__init__.py", "interface/__init__.py"}  # which has modules of its own
    assert set(found) <= may, "import it from the room that defines it"


def test_only_its_command_imports_the_studio():
    found = offenders(lambda path, text: layer_of(path) != "studio" and "studio" in layers_of(text))
    assert set(found) <= {"cli/studio.py"}, "move what others need out of the studio, into the room whose subject it is"


@pytest.mark.parametrize("name", KERNELS)
def test_array_kernels_know_no_nouns(name):
    nouns = layers_of((SOURCE / name).read_text()) & set(NOUNS)
    assert nouns == set(), "take arrays as arguments, or take the file out of KERNELS if it is none"


def test_files_and_functions_are_short():
    long_files = {name_of(path): n for path, text in TEXTS.items() if (n := len(text.splitlines())) > MOST_LINES_A_FILE}
    assert long_files == {}, f"split by subject: {MOST_LINES_A_FILE} lines at most"
    long_ones = offenders(lambda _, text: [name for name, n in functions_of(text) if n > MOST_LINES_A_FUNCTION])
    assert long_ones == {}, f"name a part of it and take it out: {MOST_LINES_A_FUNCTION} lines at most, docstring aside"


def test_numbers_without_a_word_are_found():
    source = 'A = 1  # px\n# px\nB = (1, -2.0)\nC = "#"\nD = np.array([\n    1,  # px\n])\nE = len("#")\n'
    assert numbers_without_a_word(source) == []
    assert numbers_without_a_word("# px\n\nA = 1 / 480\nB: float = np.radians(2)\n") == [
        "A = 1 / 480",
        "B: float = np.radians(2)",
    ]


def test_every_number_of_a_module_says_what_it_is():
    found = offenders(lambda _, text: numbers_without_a_word(text))
    assert found == {}, "say in a comment beside it what it is, its unit, and its source, be it only 'chosen'"


def test_length_of_a_function_leaves_its_docstring_out():
    source = 'def f():\n    """One.\n\n    Two.\n    """\n    return 1\n'
    assert dict(functions_of(source)) == {"f": 2}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_says_what_it_is_and_what_is_public(package):
    tree = ast.parse((SOURCE / package / "__init__.py").read_text())
    assert len((ast.get_docstring(tree) or "").split()) >= 5, "write what comes in and what goes out, as its docstring"
    lists = [node.value for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == "__all__"]
    assert len(lists) == 1, "list its public names in __all__, once"
    names = ast.literal_eval(lists[0])
    assert names and len(set(names)) == len(names), "list each public name of the package once in __all__"


def test_the_command_line_opens_without_numbers_and_figures():
    heavy = ["numpy", "scipy", "numba", "cv2", "pydantic", "matplotlib", "nicegui"]
    code = f"import sys, airborne.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stderr == ""
    assert done.stdout.strip() == "[]", IMPORT_LATE


def test_tracking_loads_no_figures_and_no_windows():
    code = f"import sys, airborne.tracking, airborne.tracking.methods; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stderr == ""
    assert done.stdout.strip() == "[]", IMPORT_LATE


def test_a_run_without_pictures_loads_no_library_of_figures_or_labelled_tables():
    heavy = ("matplotlib", "xarray", "pandas", "trimesh", "jinja2", "nicegui", "dask", "pyarrow")
    code = f"import sys, airborne.run.track, airborne.trial.file; print(*({{*sys.modules}} & {{*{heavy}}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [], IMPORT_LATE


def test_the_page_of_the_architecture_names_places_that_are_there():
    """Whoever adds something is sent to files, functions and tables: none may have gone."""
    text = (SOURCE.parents[1] / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    rows = [line for line in text.partition("## Where to put")[2].splitlines() if line.startswith("| ")][2:]
    code = "\n".join(path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py"))
    assert len(rows) > 30, "put the table back below the heading Where to put something new, or look for it elsewhere"
    for row in rows:
        folders = [SOURCE, SOURCE.parents[1]]
        for name in re.findall(r"`([^`]+)`", row):
            if "/" in name or "." in name.strip("."):
                places = [folder / name for folder in folders]
                found = next((place for place in places if place.exists()), None)
                is_of_run = name.endswith(".csv") or name == "trial.toml"  # not a file of the code
                assert found or is_of_run, (
                    f"name its new place in docs/explanation/architecture.md, {name} is not there: {row}"
                )
                folders += [] if found is None else [found.parent, found]
            else:
                assert re.search(rf"\b{re.escape(name.strip('[]'))}\b", code), (
                    f"name in docs/explanation/architecture.md what {name} has become: {row}"
                )
