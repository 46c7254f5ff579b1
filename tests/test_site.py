"""The site of the pages: built without a warning, complete, and readable with no network."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib.util import find_spec

import pytest

from tests.support.places import ROOT

DOCS = ROOT / "docs"
NEEDED = ("sphinx", "myst_parser", "sphinx_gallery", "pydata_sphinx_theme", "latex2mathml", "ziamath")
absent = [name for name in NEEDED if find_spec(name) is None]
pytestmark = pytest.mark.skipif(
    bool(absent), reason=f"THE SITE IS NOT TESTED: {', '.join(absent)} not installed; pip install -e '.[docs]'"
)
LOADED = {
    "script": "src",
    "img": "src",
    "link": "href",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "audio": "src",
}
LINKS_ONLY = {"canonical", "license", "author", "search", "index", "next", "prev"}  # links that load nothing


class Resources(HTMLParser):
    """Everything that a browser loads to show a page."""

    def __init__(self, page):
        super().__init__()
        self.found = []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag in LOADED and given.get("rel") not in LINKS_ONLY:
            self.found += [given.get(LOADED[tag]) or "", *(given.get("srcset") or "").split(",")]
        self.found += re.findall(r"url\(([^)]*)\)", given.get("style") or "")


def is_remote(address):
    return re.match(r"\s*['\"]?(https?:)?//", address) is not None


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site; warnings are errors."""
    folder = tmp_path_factory.mktemp("site")
    options = ["-W", "--keep-going", "-q", "-D", "sphinx_gallery_conf.run_stale_examples=1", "-d", folder / "doctrees"]
    command = [sys.executable, "-m", "sphinx", *options, DOCS, folder / "html"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_nothing_is_loaded_from_the_web(site):
    remote = {}
    for page in site.rglob("*.html"):
        found = [address for address in Resources(page.read_text(encoding="utf-8")).found if is_remote(address)]
        if found:
            remote[page.name] = found
    for sheet in site.rglob("*.css"):
        found = re.findall(r"(?:url\(|@import\s+)\s*['\"]?((?:https?:)?//[^'\")]+)", sheet.read_text(encoding="utf-8"))
        if found:
            remote[sheet.name] = found
    assert remote == {}


def test_there_is_an_index_to_search_in(site):
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    assert "somersault" in index
    assert (site / "search.html").is_file()


def test_every_page_is_in_a_table_of_contents(site):
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md")} - {"index"}
    listed = set()
    for path in DOCS.rglob("index.md"):
        text = path.read_text(encoding="utf-8")
        for block in re.findall(r"^```{toctree}\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            names = [line.strip() for line in block.splitlines() if line.strip() and not line.startswith(":")]
            listed |= {(path.parent / name).resolve().relative_to(DOCS).as_posix() for name in names}
    assert pages <= listed
    assert [page for page in sorted(pages) if not (site / f"{page}.html").is_file()] == []


def test_the_gallery_shows_a_picture_of_every_program(site):
    programs = sorted((ROOT / "examples" / "gallery").glob("plot_*.py"))
    assert len(programs) >= 4
    pictures = {path.name for path in (site / "_images").iterdir()}
    assert [path.stem for path in programs if f"sphx_glr_{path.stem}_001.png" not in pictures] == []


def test_formulas_are_drawn_by_the_browser_itself(site):
    text = (site / "explanation" / "methods.html").read_text(encoding="utf-8")
    assert text.count("<math") > 20
    assert [each for each in Resources(text).found if re.search("mathjax|katex", each, re.IGNORECASE)] == []


def test_every_command_and_room_has_its_reference(site):
    commands = (site / "reference" / "commands.html").read_text(encoding="utf-8")
    for name in ("airborne track", "airborne fit-body", "airborne synth block"):
        assert f">{name}<" in commands
    assert "is [start] right?" in commands
    assert "px_from_world" in (site / "reference" / "python" / "airborne.cameras.html").read_text(encoding="utf-8")
