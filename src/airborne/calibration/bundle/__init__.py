"""One bundle adjustment for every kind of evidence about cameras.

In come an initial `Rig`, what may change (`FreeParameters` by camera) and the observations (`Source`s, any number); out
comes an `Adjustment`: the rig, every free point and target, residuals, standard deviations. Knows no file and no video.

**To add a source** write a function that returns a `Source`, from an initial rig where it needs one:

- `camera, point, px`: one row an observation: row of the rig, row of `points`, pixel.
- Known world points (control points, court corners): `points` in metres, nothing else.
- Free world points (wand ends, joints of a person): the same with `is_free=np.ones(len(points), bool)` and the points
  triangulated with the initial rig as `points`. A point that fewer than two cameras see is left out, unless a length or
  a known coordinate determines it: `is_free` may be given by coordinate (p, 3), as for a point on the floor.
- A rigid target that moves (board): `points` in the target's axes, `moment` the row of `world_from_target`.
- Known distances between free points (wand, limbs): `Lengths`.
- `sd_px`: the pixels' standard deviations; only ratios within a source matter unless `sd_is_known`, because each
  source's own scale is estimated from its residuals.
- `lags`: cameras that do not expose at the same instant.
- `cluster`: a number by observation; those with the same number have correlated errors (all corners of one board view,
  a joint that a network detects with a constant bias). Standard deviations then count clusters, not observations.

- `is_surveyed`, `is_object`, `is_of_lens`: what checks and reports ask of a source, whose name they do not know.

Pixels are those of the calibration's images, (0, 0) the centre of the top-left pixel; metres; radians.
Without known world points the world frame is a gauge freedom: it stays, as a whole, where the initial rig has it, and
so does the scale unless a target or a length fixes it. Map the result with `Adjustment.transform` afterwards.
"""

from airborne.calibration.bundle.adjustment import Adjustment, adjust
from airborne.calibration.bundle.source import ALL_FIXED, CameraPrior, FreeParameters, Lengths, ObservationLags, Source

__all__ = ["ALL_FIXED", "Adjustment", "CameraPrior", "FreeParameters", "Lengths", "ObservationLags", "Source", "adjust"]
