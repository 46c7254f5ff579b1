"""The button that fits a first pose to the pictures; the pose before stays beside it, to compare."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import ui

from airborne.studio.fitting import FirstPoseFit, describe_quality, fit_to_frame
from airborne.studio.outlines import BESIDE_COLOUR, outline_items
from airborne.studio.pages.pose_hand import PoseHand
from airborne.studio.pages.slow_work import complain, show_errors, work
from airborne.studio.session import Session
from airborne.studio.starts import keep_start, read_draft_start, start_from_pose

_WHAT = "pose fitted to the pictures"  # of an undo


class FitButton:
    """One window's button to fit the pose that a hand holds."""

    def __init__(
        self,
        session: Session,
        hand: PoseHand,
        *,
        frame_of: Callable[[], int],
        on_fit: Callable[[str, str], None],
        settle: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        """Lay it out; `on_fit` gets what there is to say, and what was done, when the hand holds the fitted pose.

        `settle` waits for the pose that is on its way.
        """
        self.session, self.hand, self._frame_of, self._on_fit, self._settle = session, hand, frame_of, on_fit, settle
        self._button = ui.button("Fit it to the pictures", on_click=self.fit).props("flat dense")

    async def fit(self) -> None:
        """Track the frame alone, from the hand's pose; one fit at a time."""
        self._button.disable()
        try:
            if self._settle is not None:
                await self._settle()
            await self._fit()
        finally:
            self._button.enable()

    async def _fit(self) -> None:
        hand, before, frame, kept = self.hand, self.hand.pose, self._frame_of(), read_draft_start(self.session)
        if before is None:
            complain("place the body by hand first, find it automatically, or click its landmarks")
            return
        fit = await work("fitting the body", lambda: fit_to_frame(self.session, hand.model, frame, before))
        if fit is None:
            return
        says = f"Frame {frame} is fitted. {describe_quality(fit)}"
        if hand.pose is before:
            hand.place(fit.pose)
            hand.before = outline_items(hand.model.with_pose(before), hand.cameras, BESIDE_COLOUR)
            self._on_fit(f"{says} The pose before it is drawn in pink.", _WHAT)
        elif self._frame_of() != frame and read_draft_start(self.session) == kept:
            self._keep(frame, fit, says)
        else:
            complain(f"the pose was changed while it was fitted in frame {frame}; press Fit again")

    def _keep(self, frame: int, fit: FirstPoseFit, says: str) -> None:
        """Keep the fit of a frame that is no longer in view."""
        with show_errors():
            keep_start(self.session, start_from_pose(self.hand.model, frame, fit.pose), _WHAT)
            ui.notify(f"{says} Go back to frame {frame} to see it.", multi_line=True)
