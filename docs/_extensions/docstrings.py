"""Docstrings as the reference shows them: names in `backticks` as code, and beside a field its shape and unit."""

import dataclasses
import inspect
import re


def setup(app):
    """Look at everything that is documented."""
    app.connect("autodoc-process-docstring", _change)
    app.connect("autodoc-process-signature", _shorten)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _change(app, what, name, obj, options, lines):
    lines[:] = literals("\n".join(lines)).split("\n")
    if what == "class" and dataclasses.is_dataclass(obj):
        lines += ["", *(f":param {field}: {text}" for field, text in comments(obj))]


def _shorten(app, what, name, obj, options, signature, returns):
    """Write ... for a default that a dataclass makes anew each time."""
    return (signature or "").replace("<factory>", "...") or None, returns


def literals(text):
    """Turn `name` into ``name``, a literal of reStructuredText, also in front of a letter: `Name`s."""
    return re.sub(r"(?<!`)`([^`]+)`(?!`)(\w?)", lambda m: f"``{m[1]}``" + (rf"\ {m[2]}" if m[2] else ""), text)


def comments(cls):
    """Return the fields of a dataclass that have a comment on their line, and the comments."""
    names = {field.name for field in dataclasses.fields(cls)}
    found = re.findall(r"^    (\w+): [^#\n]*# (.*)$", inspect.getsource(cls), re.MULTILINE)
    return [(field, literals(re.sub(r"([\\*|_])(?![^`]*`)", r"\\\1", text))) for field, text in found if field in names]
