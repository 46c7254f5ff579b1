"""A page that asks for something from elsewhere is found out by the tests' browser, and gets nothing."""

import re

import pytest

from tests.support.browser import open_file

PAGE = """<!doctype html><title>elsewhere</title>
<img src="http://192.0.2.1/picture.png" onerror="document.title = 'nothing came'">
<script>addEventListener("load", () => new WebSocket("ws://192.0.2.1/socket"))</script>"""  # an address for documents


def test_a_request_and_a_socket_to_elsewhere_fail_a_test(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(PAGE)
    with pytest.raises(AssertionError) as failure, open_file(path) as page:
        page.wait_for_function("document.title == 'nothing came'")
    asked = set(re.findall(r"a request to (\S+?)'", str(failure.value)))
    assert asked == {"http://192.0.2.1/picture.png", "ws://192.0.2.1/socket"}
