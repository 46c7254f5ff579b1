"""A recording's frames read again, in any stretch and in either direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from airborne.video.frames import Frames
from airborne.video.recording import Recording

_MOST_BYTES = 6e8  # of pictures held at once: what is read backward is decoded forward, piece by piece


@dataclass(frozen=True, slots=True)
class Rereading:
    """The frames of a recording by their numbers."""

    recording: Recording

    def forward(self, start: int, stop: int | None) -> Iterator[Frames]:
        """Yield the frames from `start` to before `stop`; None: to the end."""
        return iter(replace(self.recording, start=start, stop=self.recording.stop if stop is None else stop))

    def backward(self, start: int, stop: int) -> Iterator[Frames]:
        """Yield the same in reverse, the last one first."""
        n_bytes = sum(3 * facts.size[0] * facts.size[1] for facts in self.recording.facts)
        every = self.recording.every
        most = max(int(_MOST_BYTES / n_bytes), 1)
        for begin in reversed(range(start, stop, every * most)):
            yield from reversed(list(self.forward(begin, min(begin + every * most, stop))))
