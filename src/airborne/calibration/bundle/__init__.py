"""One bundle adjustment for every kind of evidence about cameras.

In come a start (`Rig`), what may change (`Freedom` by camera) and the evidence (`Source`s, as many as there are); out
comes `Adjusted`: the rig, every free point and target, residuals, standard deviations. It knows no file and no video.

**To add a source** write a function that returns a `Source`, given a start rig where it needs one:

- `camera, point, px`: one row for each place seen in a picture: row of the rig, row of `points`, pixel.
- Known world points (control points, court corners): `points` in metres, nothing else.
- Free world points (wand ends, joints of a person): the same with `is_free=np.ones(len(points), bool)` and the points
  triangulated with the start rig as `points`. A point that fewer than two cameras see is left out by itself, unless a
  length or a known coordinate ties it: `is_free` may be given by coordinate (p, 3), as for a point on the floor.
- A rigid target that moves (board): `points` in the target's axes, `moment` the row of `world_from_target`.
- Known distances between free points (wand, limbs): `Lengths`.
- `sd_px`: how exact the pixels are thought to be; only ratios within a source matter unless `sd_is_known`, because each
  source's own scale is found from its residuals.
- `lags`: cameras that do not look at the same instant.
- `cluster`: a number by observation; those with the same number err together (all corners of one board view, a joint
  that a network sees steadily beside its place). Standard deviations then count clusters, not observations.

Pixels are those of the calibration's pictures, (0, 0) the centre of the top-left pixel; metres; radians.
Without known world points the world frame is free: it stays, as a whole, where the start rig has it, and so does the
scale unless a target or a length gives it. Move the result with `Adjusted.moved` afterwards.
"""

from airborne.calibration.bundle.adjustment import Adjustment, adjust
from airborne.calibration.bundle.source import ALL_FIXED, CameraPrior, FreeParameters, Lengths, ObservationLags, Source

__all__ = ["ALL_FIXED", "Adjustment", "CameraPrior", "FreeParameters", "Lengths", "ObservationLags", "Source", "adjust"]
