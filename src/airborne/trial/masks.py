"""[[mask]]: a camera that is left out of some frames."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from airborne.io.names import Name
from airborne.trial.table import SettingsTable


class MaskTable(SettingsTable):
    """A camera whose images of some frames are not used: someone stands before it, or it was moved."""

    camera: Name
    first: Annotated[int, Field(ge=0)]  # frame, or field
    last: Annotated[int, Field(ge=0)]  # left out too

    @model_validator(mode="after")
    def _check_order(self) -> MaskTable:
        if self.last < self.first:
            raise ValueError(f"last = {self.last} lies before first = {self.first}; exchange them")
        return self
