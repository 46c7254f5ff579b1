"""The page on the command line, written from the commands themselves."""

import inspect
import re
from pathlib import Path
from types import NoneType, UnionType
from typing import Literal, Union, get_args, get_origin, get_type_hints

from airborne.cli import command_tree

PAGE = "reference/commands"


def setup(app):
    """Put every command's help below the page's own text."""
    app.connect("source-read", _add)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _add(app, name, source):
    if name == PAGE:
        source[0] += "\n\n" + "\n\n".join(sections(command_tree(), "airborne"))


def sections(command, name):
    """Yield one section for every command below this one, each in Markdown."""
    children = getattr(command, "commands", {})
    if not children:
        yield section(command, name)
    for word, child in children.items():
        yield from sections(child, f"{name} {word}")


def section(command, name):
    """Return the heading, help, example and options of one command."""
    text, _, example = (command.help or "").partition("Example: ")
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    options = [each for each in command.params if each.param_type_name == "option" and each.name != "help"]
    usage = " ".join([name, *map(_placeholder, arguments), *(["[OPTIONS]"] if options else [])])
    parts = [f"## {name}", _plain(text.strip()), f"```text\n{usage}\n```"]
    if arguments:
        rows = [f"| `{_placeholder(each)}` | {_plain(each.help)} |" for each in arguments]
        parts.append("\n".join(["| argument | meaning |", "| --- | --- |", *rows]))
    if options:
        kinds = get_type_hints(inspect.unwrap(command.callback))
        cells = [(_flags(each), _takes(each, kinds[each.name]), _default(each), _plain(each.help)) for each in options]
        rows = [f"| {' | '.join(row)} |" for row in cells]
        parts.append("\n".join(["| option | takes | default | meaning |", "| --- | --- | --- | --- |", *rows]))
    return "\n\n".join([*parts, f"```bash\n{example.strip()}\n```"])


def _placeholder(argument):
    return (argument.metavar or argument.name).upper() + ("..." if argument.nargs == -1 else "")


def _flags(option):
    return ", ".join(f"`{flag}`" for flag in (*option.opts, *option.secondary_opts))


def _takes(option, kind):
    """Return what an option takes, by its annotation."""
    if option.is_flag:
        return ""
    is_union = get_origin(kind) in (Union, UnionType)
    kinds = [each for each in get_args(kind) if each is not NoneType] if is_union else [kind]
    if get_origin(kinds[0]) is list:
        kinds = list(get_args(kinds[0]))
    if get_origin(kinds[0]) is Literal:
        return ", ".join(f"`{each}`" for each in get_args(kinds[0]))
    least, most = getattr(option, "min", None), getattr(option, "max", None)
    bounds = [] if least is None else [f"{least:g} or more" if most is None else f"{least:g} to {most:g}"]
    words = {str: "text", int: "whole number", float: "number", Path: "path"}
    return ", ".join([words[kinds[0]], *bounds])


def _default(option):
    if option.required:
        return "required"
    if option.is_flag or option.default in (None, (), []):
        return ""
    return f"`{getattr(option.default, 'value', option.default)}`"


def _plain(text):
    """Return text as Markdown that shows it as it is."""
    escaped = re.sub(r"([\\<*|\[\]])", r"\\\1", " ".join((text or "").split()))
    return re.sub(r"(?<![\w`])(--[a-z][a-z-]*)", r"`\1`", escaped)
