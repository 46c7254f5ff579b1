"""Names: a public one has one home, no function has its module's, few functions take many arguments by position."""

import ast
from collections import Counter

from tests.test_architecture import SOURCE, TEXTS, parse

MOST_BY_POSITION, MOST_THAT_TAKE_MORE = 4, 20  # chosen: more than four are mistaken for one another


def definitions_of(source):
    """The functions and classes at the top of a source text."""
    return [node for node in parse(source).body if isinstance(node, ast.FunctionDef | ast.ClassDef)]


def public_names(path):
    """Those that a module defines; the interface's functions are called as what they hand on to."""
    is_interface = "interface" in path.relative_to(SOURCE).parts
    return [] if is_interface else [each.name for each in definitions_of(TEXTS[path]) if each.name[0] != "_"]


def take_many(source):
    """Functions that take more than four arguments by position; kernels know no names of arguments."""
    for node in ast.walk(parse(source)):
        if isinstance(node, ast.FunctionDef) and "kernel" not in " ".join(map(ast.unparse, node.decorator_list)):
            names = [each.arg for each in node.args.posonlyargs + node.args.args]
            if len([name for name in names if name not in ("self", "cls")]) > MOST_BY_POSITION:
                yield node.name


def test_many_arguments_are_counted_where_they_have_no_names():
    assert list(take_many("def f(a, b, c, d, e): ...\ndef g(self, a, b, c, d, *, e): ...\n")) == ["f"]
    assert list(take_many("@kernel\ndef f(a, b, c, d, e): ...\n")) == []


def test_a_public_name_is_defined_once():
    counts = Counter(name for path in TEXTS for name in public_names(path))
    twice = [name for name, n in counts.items() if n > 1]
    assert twice == [], "rename one of each two, or let both places import it: a public name means one thing"


def test_no_function_has_the_name_of_its_module():
    same = [str(path) for path in TEXTS if path.stem in public_names(path)]
    assert same == [], "rename module or function: importing one would hide the other"


def test_few_functions_take_more_than_four_arguments_by_position():
    many = [name for text in TEXTS.values() for name in take_many(text)]
    assert len(many) <= MOST_THAT_TAKE_MORE, f"put * before the new one's arguments from the third or so on: {many}"
