"""Yeadon's measurement files: read as the package `yeadon` reads them, written, and refused in one line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from airborne.body import human18, human18_from_measurements, read_measurements
from airborne.body.anthropometry import measurements_of, segment_properties
from airborne.body.measurements import STATURE_SHARES, check_measurements
from airborne.errors import BodyError
from tests.support.bodies import write_measurements
from tests.support.tolerances import EXACT, ROUNDTRIP

PERSON = measurements_of(1.72, 66.0)


def text_of(values, factor=0.01, **more):
    """A file's text; values in metres are written in the unit of the factor."""
    lines = [f"measurementconversionfactor: {factor}", *(f"{key}: {value}" for key, value in more.items())]
    return "\n".join([*lines, *(f"{key}: {value / factor!r}" for key, value in values.items())]) + "\n"


def read(tmp_path, text):
    path = tmp_path / "athlete.txt"
    path.write_text(text, encoding="utf-8")
    return read_measurements(path)


def complaint(tmp_path, text):
    with pytest.raises(BodyError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith("athlete.txt: ")
    assert "\n" not in message
    return message


def test_what_is_written_is_read_back_to_the_last_digit(tmp_path):
    for person in (PERSON, replace(PERSON, mass_kg=None)):
        write_measurements(tmp_path / "athlete.txt", person)
        again = read_measurements(tmp_path / "athlete.txt")
        assert again.values_m == person.values_m
        assert again.mass_kg == person.mass_kg
        assert again.name == "athlete"


def test_the_package_yeadon_reads_a_written_file_as_the_same_person(tmp_path):
    from yeadon import Human

    write_measurements(tmp_path / "athlete.txt", replace(PERSON, mass_kg=None))
    human = Human(str(tmp_path / "athlete.txt"))
    assert set(Human.measnames) == set(STATURE_SHARES)
    ours = read_measurements(tmp_path / "athlete.txt").values_m
    assert {key: human.meas[key] for key in ours} == pytest.approx(dict(ours), rel=EXACT)
    body = human18_from_measurements(tmp_path / "athlete.txt")
    assert sum(s.inertia.mass_kg for s in body.segments) == pytest.approx(human.mass, rel=EXACT * 10)


@pytest.mark.parametrize("factor", [1, 0.01, 0.001, 0.0254])
def test_the_unit_is_what_the_conversion_factor_says(tmp_path, factor):
    person = read(tmp_path, text_of(PERSON.values_m, factor, totalmass=61.5))
    assert dict(person.values_m) == pytest.approx(dict(PERSON.values_m), rel=ROUNDTRIP)
    assert person.mass_kg == 61.5


@pytest.mark.parametrize("mass", [-1, 58.25])
def test_a_weighed_mass_is_the_bodys_and_minus_one_is_none(tmp_path, mass):
    person = read(tmp_path, text_of(PERSON.values_m, totalmass=mass))
    body = human18_from_measurements(person)
    total = sum(segment.inertia.mass_kg for segment in body.segments)
    assert total == pytest.approx(mass if mass > 0 else 66.0, rel=EXACT * 10)


def test_the_preset_is_the_body_of_its_written_measurements(tmp_path):
    write_measurements(tmp_path / "athlete.txt", PERSON)
    for a, b in zip(human18(1.72, 66.0).parts, human18_from_measurements(tmp_path / "athlete.txt").parts, strict=True):
        np.testing.assert_allclose(b.shape.semi_axes_m, a.shape.semi_axes_m, atol=EXACT)


def test_numbers_may_be_written_in_any_way_and_any_order(tmp_path):
    lines = text_of(PERSON.values_m, 1).splitlines()[::-1]
    text = "# taken on a Monday\n" + "\n".join(lines).replace("factor: 1", "factor: 1e0")
    assert read(tmp_path, text).values_m == PERSON.values_m
    as_json = {"measurementconversionfactor": 1, **PERSON.values_m}  # YAML holds JSON
    assert read(tmp_path, json.dumps(as_json)).values_m == PERSON.values_m


def test_swapping_twice_changes_nothing_and_evening_ends_the_difference():
    uneven = replace(PERSON, values_m={key: v * (1.05 if key[1] in "ak" else 1) for key, v in PERSON.values_m.items()})
    assert uneven.mirror().values_m != uneven.values_m
    assert uneven.mirror().mirror().values_m == uneven.values_m
    assert uneven.mirror().values_m["Lb2L"] == uneven.values_m["La2L"]
    even = uneven.symmetrise()
    assert even.mirror().values_m == even.values_m
    assert even.values_m["Lj3L"] == pytest.approx(1.025 * PERSON.values_m["Lj3L"], rel=EXACT)
    assert even.values_m["Ls1L"] == PERSON.values_m["Ls1L"]


def test_limbs_are_symmetrised_unless_the_person_is_to_stay_as_measured():
    uneven = replace(PERSON, values_m={key: v * (1.05 if key[1] == "a" else 1) for key, v in PERSON.values_m.items()})

    def arms(body):
        return [-body.segments[body.index_of(f"forearm_{side}")].joint_m[2] for side in ("left", "right")]

    left, right = arms(human18_from_measurements(uneven))
    assert left == pytest.approx(right, rel=EXACT)
    left, right = arms(human18_from_measurements(uneven, symmetric=False))
    assert left == pytest.approx(1.05 * right, rel=ROUNDTRIP)


def test_a_section_deeper_than_wide_weighs_as_the_round_one_that_yeadon_makes_of_it(capsys):
    from yeadon import Human

    deep = replace(PERSON, mass_kg=None, values_m={**PERSON.values_m, "Ls2w": PERSON.values_m["Ls2p"] / 3.6})
    with pytest.warns(UserWarning, match="Ls2"):
        human = Human(dict(deep.values_m))
    assert "stadium set as circle" in capsys.readouterr().out
    assert sum(b.inertia.mass_kg for b in segment_properties(deep).values()) == pytest.approx(
        human.mass, rel=EXACT * 10
    )


FACTOR = "measurementconversionfactor: 0.01"


def line(key):
    return f"{key}: {PERSON.values_m[key] / 0.01!r}"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (line("La3p"), "", "La3p is missing; expected a length above zero"),
        (line("La3p"), "La3p:", "La3p is missing"),
        (line("La3p"), "La3p: -24", "La3p is -0.24 m; expected a length above zero, usually about 0.258 m"),
        (line("La3p"), "La3p: 0", "La3p is 0 m; expected a length above zero"),
        (line("La3p"), "La3p: 258", "La3p is 2.58 m after conversion; expected about 0.258 m: check its unit"),
        (line("La3p"), "La3p: 0.258", "La3p is 0.00258 m after conversion"),
        (line("La3p"), "La3p: thick", "La3p is 'thick'; expected a length above zero, a number"),
        (line("La3p"), "La3p: .nan", "La3p is '.nan'"),
        (line("La3p"), "La3p: true", "La3p is 'true'"),
        (line("La3p"), "La3p: [1, 2]", "line 32: expected one value"),
        (line("La3p"), f"{line('La3p')}\nLa3p: 25", "La3p is given twice"),
        (line("La3p"), f"{line('La3p')}\nLa8p: 25", "La8p is no measurement"),
        (line("Lj4L"), "Lj4L: 88", "Lj5L is 0.84452 m, Lj4L 0.88 m; both are measured from the same joint"),
        (line("Ls2w"), "Ls2w: 45", "Ls2p is 0.7"),
        (line("Ls2w"), "Ls2w: 18", "expected 2 to 4 times the width"),
        (line("Ls4d"), "Ls4d: 60", "the trunk must be wider than deep there"),
        (FACTOR, "", "measurementconversionfactor is missing; give measurementconversion"),
        (FACTOR, "measurementconversionfactor: 0", "measurementconversionfactor is 0"),
        (
            "measurementconversionfactor: 0.01",
            "measurementconversionfactor: 1",
            "check its unit (measurementconversion",
        ),
        (FACTOR, "measurementconversionfactor: 0.001", "check its unit"),
        (
            "measurementconversionfactor: 0.01",
            f"{FACTOR}\ntotalmass: 66000",
            "totalmass is 66000",
        ),
        (
            "measurementconversionfactor: 0.01",
            f"{FACTOR}\ntotalmass: heavy",
            "totalmass is 'heavy'",
        ),
        ("Ls1L: ", "Ls1L= ", "not a YAML file of measurements"),
    ],
)
def test_a_mistake_is_refused_in_one_line_that_names_file_key_and_what_was_expected(tmp_path, old, new, expected):
    text = text_of(PERSON.values_m)
    assert old in text
    assert expected in complaint(tmp_path, text.replace(old, new, 1))


def test_files_of_another_kind_are_refused(tmp_path):
    for text in ("", "- 1\n- 2\n", "Ls1L=4.9\nLs2L=18.8\n", "just words"):
        assert "holds no measurements; expected lines such as 'Ls1L: 0.135'" in complaint(tmp_path, text)
    assert "not a YAML file" in complaint(tmp_path, "a: [1, 2")
    with pytest.raises(BodyError, match=r"none\.txt: cannot be read"):
        read_measurements(tmp_path / "none.txt")
    with pytest.raises(BodyError, match=r"none\.txt: cannot be read"):
        human18_from_measurements(str(tmp_path / "none.txt"))
    (tmp_path / "binary.txt").write_bytes(bytes(range(256)))
    with pytest.raises(BodyError, match=r"binary\.txt: not a YAML file"):
        read_measurements(tmp_path / "binary.txt")


def test_a_value_left_out_of_a_person_made_in_memory_is_named():
    values = {key: value for key, value in PERSON.values_m.items() if key != "Lk9w"}
    with pytest.raises(BodyError, match="Lk9w is missing; expected all 95 measurements"):
        check_measurements(replace(PERSON, values_m=values))
    with pytest.raises(BodyError, match="Lk9w is missing"):
        human18_from_measurements(replace(PERSON, values_m=values))
