"""What becomes of a file: bytes flipped, cut, doubled, numbers and words exchanged, nests, bombs. `how(data, rng)`."""

import io
import re
import zipfile
from functools import cache

NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_]{2,}")
NASTY_NUMBERS = [
    *(b"nan", b"inf", b"-inf", b"-1", b"0", b"1e308", b"-1e308", b"1e-320", b"1e400", b"1e999999999", b"9" * 5000),
    *(b"9223372036854775808", b"1000000000", b"-1000000000000", b"1_000", b"0x10", "٣".encode(), b"1/0", b"true"),
    *(b"", b'"x"', b"[]", b"[1, [2]]", b"{}", b"null", b"1979-05-27", b"1:2:3", b"--1", b"1 2"),
]
NASTY_TEXT = [
    *(b"", b" ", b"\x00", b"\xff\xfe", b"../../x", b"/dev/zero", b"a" * 200_000, b"\n", b'"', b"'", b"<", b"&amp;"),
    *(
        "ä\u2028\U0001f600".encode(),
        b"\r\n",
        b"%s%n",
        b"{0}",
        b"__class__",
        b"\x1b[31m",
        b"!!python/object:os.system x",
        *(b"!!%s x" % tag for tag in (b"int", b"float", b"timestamp", b"binary", b"set", b"omap", b"pairs", b"null")),
    ),
]
NESTS = [b"[", b"{", b"[[", b'{"a":', b"<a>", b"a: {", b"a.", b"- ", b"(", b'"a"=[', b"((("]
XML_BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaaaaaaaaaaaa">'
    + b"".join(b'<!ENTITY a%d "%s">' % (i, b"&a%s;" % (str(i - 1).encode() if i else b"") * 20) for i in range(9))
    + b"]><calibration><cameras><camera serial='&a8;'/></cameras></calibration>"
)
YAML_BOMB = b"%YAML:1.0\n---\na0: &a0 [x, x, x]\n" + b"".join(
    b"a%d: &a%d [*a%d, *a%d, *a%d, *a%d]\n" % (i, i, *[i - 1] * 4) for i in range(1, 40)
)
YAML_MERGES = b"a0: &a0 {k: 1}\n" + b"".join(
    b"a%d: &a%d {<<: [%s]}\n" % (i, i, b", ".join([b"*a%d" % (i - 1)] * 9)) for i in range(1, 30)
)


def flipped(data, rng):
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 3, 30])):
        if changed:
            changed[rng.randrange(len(changed))] = rng.randrange(256)
    return bytes(changed)


def cut(data, rng):
    return data[: rng.randrange(len(data) + 1)]


def hole(data, rng):
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:a] + data[min(b, a + rng.choice([1, 10, 1000])) :]


def doubled(data, rng):
    lines = data.split(b"\n")
    a = rng.randrange(len(lines))
    some = lines[a : a + rng.choice([1, 1, 5])]
    b = rng.randrange(len(lines) + 1)
    return b"\n".join([*lines[:b], *(some * rng.choice([1, 2, 500])), *lines[b:]])


def shuffled(data, rng):
    lines = data.split(b"\n")
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def renumbered(data, rng):
    places = list(NUMBER.finditer(data))
    for place in sorted(rng.sample(places, min(len(places), rng.choice([1, 1, 2, 8]))), key=lambda m: -m.start()):
        data = data[: place.start()] + rng.choice(NASTY_NUMBERS) + data[place.end() :]
    return data


def reworded(data, rng):
    places = list(WORD.finditer(data))
    if not places:
        return data
    place = rng.choice(places)
    other = rng.choice([*NASTY_TEXT, *(rng.choice(places).group() for _ in range(8))])
    return data[: place.start()] + other + data[place.end() :]


def nested(data, rng):
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(NESTS) * rng.choice([50, 3000, 100_000]) + rng.choice([b"", data[at:]])


def lengthened(data, rng):
    at = rng.randrange(len(data) + 1)
    return (
        data[:at] + rng.choice([b"1,", b"0", b"\n", b",", b"\t", b'"', b"a,"]) * rng.choice([300, 140_000]) + data[at:]
    )


def rubbish(data, rng):
    return rng.choice(
        [b"", b"\n" * 1000, rng.randbytes(rng.choice([1, 100, 5000])), data + rng.randbytes(50), data * 30]
    )


def bomb(data, rng):
    head = rng.choice([b"", data[:100]])
    return rng.choice(
        [XML_BOMB, YAML_BOMB, YAML_MERGES, *npz_bombs(), head + b"a = " + b"[" * 50_000, b"a" + b".a" * 20_000 + b"=1"]
    )


@cache
def npz_bombs():
    """A pickle, an array that declares itself huge, one that unpacks to gigabytes, one with a broken header."""

    def packed(header, body=b""):
        text = io.BytesIO()
        with zipfile.ZipFile(text, "w", zipfile.ZIP_DEFLATED) as archive:
            for camera in ("left", "right", "side"):
                magic = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
                archive.writestr(f"{camera}.npy", magic + body)
        return text.getvalue()

    shape = b"{'descr': '%s', 'fortran_order': False, 'shape': (%s), }\n"
    return (
        packed(shape % (b"|O", b"3,"), b"\x80\x04cos\nsystem\n."),
        packed(shape % (b"<f8", b"100000, 26, 30000")),
        packed(shape % (b"<f8", b"1000, 26, 3"), bytes(3_000_000)),
        packed(b"{'descr': ((((("),
        packed(shape % (b"<U9", b"3, 26, 3"), bytes(10_000)),
        packed(shape % (b"<f8", b"-3, 26, -3"), bytes(10_000)),
    )


MUTATORS = [flipped, cut, hole, doubled, shuffled, renumbered, renumbered, reworded, reworded, nested, lengthened]
MUTATORS += [rubbish, bomb]
