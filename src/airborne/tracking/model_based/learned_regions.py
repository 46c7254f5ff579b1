"""The regions of one time whose colours have been learned, and their images prepared for fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from airborne.appearance.model import Appearance, Region
from airborne.body import PosedBody
from airborne.rendering import EvidenceMaps
from airborne.tracking.image_regions import narrow_regions
from airborne.tracking.model_based.gauss_newton import Posteriors
from airborne.tracking.model_based.global_search import region_evidence
from airborne.tracking.model_based.image_views import ImageView, make_image_views
from airborne.tracking.model_based.learning import learn_missing_backgrounds
from airborne.tracking.model_based.render_model import RenderModel
from airborne.types import Array32

MARGIN_PX = 12  # of a full frame: the blur's radius, and how far images move a body beyond its silhouettes


@dataclass(frozen=True, eq=False)
class LearnedRegions:
    """The regions of one time whose colours have been learned."""

    masks: Posteriors
    appearance: Appearance
    # images prepared by an appearance: where a limb is looked for, they are fitted again and again
    prepared: dict[Appearance, Sequence[ImageView]] = field(default_factory=dict)
    _of_limbs: dict[int, EvidenceMaps] = field(default_factory=dict)  # by pair

    @classmethod
    def of(cls, regions: Sequence[Region], appearance: Appearance) -> LearnedRegions:
        """Take those of the regions whose colours have been learned."""
        learned = [region for region in regions if appearance.has_colours(region)]
        return cls(Posteriors(learned, [appearance.posterior(region) for region in learned]), appearance)

    @property
    def views(self) -> tuple[Sequence[Region], Sequence[Array32]]:
        """The regions and each pixel's probability (h, w) to be body."""
        return self.masks.regions, self.masks.planes

    @cached_property
    def evidence(self) -> EvidenceMaps:
        """Each pixel's evidence for the body, for searches."""
        return region_evidence(*self.views)

    def limb_evidence(self, pair: int) -> EvidenceMaps:
        """Return each pixel's evidence for a limb of a pair, for its search: it has to look like that limb.

        By any of the body's colours, an arm would cover loose clothes, or flesh, that stand out from the model.
        """
        if pair not in self._of_limbs:
            planes = [self.appearance.limb_posterior(region, pair) for region in self.masks.regions]
            self._of_limbs[pair] = region_evidence(self.masks.regions, planes)
        return self._of_limbs[pair]

    def make_image_views(
        self, render_model: RenderModel, bodies: Sequence[PosedBody], *, are_narrow: bool
    ) -> list[ImageView]:
        """Prepare the images for a fit that starts from several poses, with a background in every region.

        are_narrow: only of the parts that hold these poses; costs are then compared with none of another fit's.
        """
        regions = self.masks.regions
        appearance = learn_missing_backgrounds(render_model, bodies[0], regions, self.appearance)
        if are_narrow:
            return make_image_views(
                render_model, narrow_regions(regions, bodies, render_model.geometry, MARGIN_PX), appearance
            )
        if appearance not in self.prepared:
            self.prepared[appearance] = make_image_views(render_model, regions, appearance)
        return [view.with_own_light() for view in self.prepared[appearance]]
