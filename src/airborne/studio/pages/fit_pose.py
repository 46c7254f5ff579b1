"""The button that fits a first pose to the pictures; the pose before stays beside it, to compare."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from airborne.studio.fitting import fit_to_frame
from airborne.studio.outlines import BESIDE_COLOUR, outline_items
from airborne.studio.pages.layout import complain, work
from airborne.studio.pages.pose_hand import PoseHand
from airborne.studio.session import Session

FITTED = "The pose is fitted to the pictures; the one before is pink."


class FitButton:
    """One window's button to fit the pose that a hand holds."""

    def __init__(
        self, session: Session, hand: PoseHand, frame_of: Callable[[], int], on_fit: Callable[[str, str], None]
    ) -> None:
        """Lay it out; `on_fit` gets what there is to say, and what was done, when the hand holds the fitted pose."""
        self.session, self.hand, self._frame_of, self._on_fit = session, hand, frame_of, on_fit
        ui.button("Fit it to the pictures", on_click=self.fit).props("flat dense")

    async def fit(self) -> None:
        """Track the frame alone, from the hand's pose."""
        hand, before, frame = self.hand, self.hand.pose, self._frame_of()
        if before is None:
            complain("place the body by hand first, find it automatically, or click its landmarks")
            return
        after = await work("fitting the body", lambda: fit_to_frame(self.session, hand.model, frame, before))
        if after is not None and hand.pose is before:
            hand.place(after)
            hand.before = outline_items(hand.model.with_pose(before), hand.cameras, BESIDE_COLOUR)
            self._on_fit(FITTED, "pose fitted to the pictures")
