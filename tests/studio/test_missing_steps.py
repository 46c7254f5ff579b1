"""A page that is opened before its time says, beside its help, which steps come first."""

import pytest

from tests.support.browser import open_page
from tests.support.studio import fork_studio

ALL = "First come Videos, Cameras, Body"
PAGES = {
    "cameras": "First comes Videos",
    "ruler": "First come Videos, Cameras",
    "thing": "First comes Videos",
    "start": ALL,
    "track": ALL,
    "digitise": "First comes Videos",
}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with fork_studio(tmp_path_factory.mktemp("empty")) as address, open_page(address) as page:
        yield page, "/".join(address.split("/")[:3])


@pytest.mark.parametrize("name", PAGES)
def test_what_comes_first_is_named_as_on_the_rail(page, name):
    page, root = page
    page.goto(f"{root}/{name}")
    says = page.locator(".warn").first
    says.wait_for()
    assert says.inner_text() == f"{PAGES[name]}: see the steps at the left."
    assert len(page.locator(".help").first.inner_text()) > 60
    rail = page.locator(".rail .title").all_inner_texts()
    assert all(
        each in rail for each in PAGES[name].removeprefix("First comes ").removeprefix("First come ").split(", ")
    )
