"""XML, read with care: no entities, no document types, numbers checked."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from airborne.cameras.formats.parsing import LARGEST_NUMBER
from airborne.errors import CalibrationError


def parse_xml(text: str, where: str) -> ElementTree.Element:
    """Return the document's root element. Raises CalibrationError, also for a document type or entities."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise CalibrationError(f"{where} declares a document type or entities; no calibration does: export it again")
    try:
        return ElementTree.fromstring(text.encode())
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise CalibrationError(f"{where} is not a calibration: as XML, {str(error)[:120]}") from None


def attribute_numbers(where: str, element: ElementTree.Element, attributes: str) -> list[float]:
    """Return the named attributes of an element as numbers; raises CalibrationError."""
    values = []
    for attribute in attributes.split():
        text = element.get(attribute)
        value = parse_number(text)
        if not abs(value) <= LARGEST_NUMBER:
            problem = "is missing" if text is None else f"is '{text[:60]}'"
            raise CalibrationError(f"{where}: {attribute} of <{element.tag}> {problem}, expected a number")
        values.append(value)
    return values


def parse_number(text: str | None) -> float:
    """Parse a number; NaN for anything else."""
    try:
        return float(text) if text is not None else np.nan
    except ValueError:
        return np.nan


def xml_text(root: ElementTree.Element) -> str:
    """Return a document as text."""
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
