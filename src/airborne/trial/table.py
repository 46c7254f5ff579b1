"""What all tables of a trial file share."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Pixel = Annotated[list[float], Field(min_length=2, max_length=2)]
Switch = Annotated[bool, Field(strict=True)]  # true or false, no number and no text
ClickTable = dict[str, dict[str, Pixel]]  # point -> camera -> u, v


class SettingsTable(BaseModel):
    """A table of a trial file: an unknown key, a number that is not finite, or a change afterwards is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
