"""What all tables of a trial file share."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Vector = Annotated[list[float], Field(min_length=3, max_length=3, strict=False)]  # of Python also a tuple
Pixel = Annotated[list[float], Field(min_length=2, max_length=2, strict=False)]
Quaternion = Annotated[list[float], Field(min_length=4, max_length=4, strict=False)]
Matrix = Annotated[list[Vector], Field(min_length=3, max_length=3, strict=False)]
ClickTable = dict[str, dict[str, Pixel]]  # point -> camera -> u, v


class SettingsTable(BaseModel):
    """A table of a trial file.

    An unknown key, a number that is not finite or given as text, a switch given as a number, or a change afterwards is
    an error.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)
