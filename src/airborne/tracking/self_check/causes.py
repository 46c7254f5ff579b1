"""What is wrong with a run, by the penalised likelihood of each cause alone, and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from airborne.constants import ALARM_SDS
from airborne.tracking.self_check.nuisances import Kind, Nuisance, allow_cause
from airborne.tracking.self_check.solution import N_BLOCKS, NuisanceSolution
from airborne.types import Array

_LEAST_EVIDENCE = 4.0  # [nats] by which a cause must explain the pictures better than none
_SAME = 3.0  # [nats] within which two causes cannot be told apart
_MOST_CAUSES = 3  # that are named one after the other
# sds of what the silhouettes and their straight-line equations leave open, however many there are
_MODEL_SD: Mapping[Kind, float] = {
    "scale": 0.003,
    "turn_deg": np.radians(0.05),
    "shift_m": 0.005,
    "focal": 0.003,
    "time_s": 0.0003,
    "drift_s": 0.001,  # chosen: three times what it was in a synthetic throw with right files
}
# the same, as a share of the value; of a time: in 16 synthetic throws 20 ms were found 15 % off (root mean square), as
# a body that turns meanwhile has another silhouette, and the tracked poses go half the way along
_MODEL_SHARE: Mapping[Kind, float] = {
    "scale": 0.02,
    "turn_deg": 0.02,
    "shift_m": 0.02,
    "focal": 0.02,
    "time_s": 0.15,
    "drift_s": 0.15,
}
# times a drift's parameter, which is from the middle of the run to that of its last block, for the whole run
_WHOLE_RUN = 2 * N_BLOCKS / (N_BLOCKS - 1)


@dataclass(frozen=True, slots=True)
class LikelyCause:
    """One cause's size, positive where the truth is larger or later than the files say; of three numbers, the norm."""

    subject: str
    kind: Kind
    value: float  # share, deg, m, s
    sd: float
    is_alarm: bool
    alternatives: tuple[str, ...] = ()  # sentences of causes that explain the same

    @property
    def sentence(self) -> str:
        """Say it, with the causes that cannot be told apart from it."""
        text = _describe(self.subject, self.kind, self.value, self.sd)
        if self.kind == "time_s" and self.is_alarm:
            text += f" (its `offset_s` should be {abs(self.value):.4f} s {_larger(self.value)})"
        if self.alternatives:
            text += f"; or {'; or '.join(self.alternatives)}: these cannot be told apart"
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return what summary.json holds."""
        names = ("subject", "kind", "value", "sd", "is_alarm", "sentence")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The findings, alarms first, and the parameters with what is known of them."""

    findings: tuple[LikelyCause, ...]
    theta: Array  # (k,)
    covariance: Array  # (k, k)

    def with_size_sd(self, sd: float) -> Diagnosis:
        """Return it with a further sd of how large the body looks, as a share."""
        findings = (
            replace(each, sd=float(np.hypot(each.sd, sd))) if (each.subject, each.kind) == ("body", "scale") else each
            for each in self.findings
        )
        return replace(self, findings=tuple(findings))

    @property
    def has_alarm(self) -> bool:
        """Whether anything is wrong."""
        return any(finding.is_alarm for finding in self.findings)


def name_causes(solution: NuisanceSolution, nuisances: Sequence[Nuisance], prior: Array) -> Diagnosis:
    """Name the likeliest causes, one after the other while each explains more than chance; list all the others."""
    named: list[tuple[Nuisance, list[Nuisance]]] = []
    k = len(prior)  # one more where a drift is found
    if (drifting := _find_drift(solution, nuisances, prior)) is not None:
        drift, solution, prior = drifting
        named.append((drift, []))
    for _ in range(_MOST_CAUSES):
        known = [cause for cause, _ in named]
        scores = _evidence(solution, [n for n in nuisances if n not in known], prior)
        clear = {
            n: score
            for n, score in scores.items()
            if (score > _LEAST_EVIDENCE and _is_clear(solution, n, allow_cause(prior, n)))
            or (n.size == 1 and _is_clear(solution, n, prior))  # a norm of three numbers is never near zero
        }
        if not clear:
            break
        best = max(clear, key=lambda n: clear[n])
        same = [n for n, score in clear.items() if n is not best and score > clear[best] - _SAME]
        named.append((best, same))
        prior = allow_cause(prior, best)
    alarms: list[LikelyCause] = []
    for best, same in named:
        without = prior - allow_cause(np.zeros_like(prior), best)
        others = [
            LikelyCause(n.subject, n.kind, *_size(solution, n, allow_cause(without, n)), is_alarm=True) for n in same
        ]
        sentences = tuple(each.sentence for each in others)
        value, sd = _size(solution, best, prior)
        alarms += [LikelyCause(best.subject, best.kind, value, sd, is_alarm=True, alternatives=sentences), *others]
    for nuisance in {each for _, same in named for each in same}:
        prior = allow_cause(prior, nuisance)
    listed = {(finding.subject, finding.kind) for finding in alarms}
    others = [
        LikelyCause(n.subject, n.kind, *_size(solution, n, prior), is_alarm=False)
        for n in nuisances
        if (n.subject, n.kind) not in listed
    ]
    theta, covariance, _ = solution.posterior(prior)
    return Diagnosis((*alarms, *others), theta[:k], covariance[:k, :k])


def _find_drift(
    solution: NuisanceSolution, nuisances: Sequence[Nuisance], prior: Array
) -> tuple[Nuisance, NuisanceSolution, Array] | None:
    """Find a camera that is later and later, or earlier, as where its frame rate is wrong, with what holds for it.

    None where that does not explain the pictures clearly better than any constant cause, or a block shows nothing.
    """
    if len(solution.without) < N_BLOCKS or any(np.array_equal(each.H, solution.H) for each in solution.without):
        return None
    best = max([*_evidence(solution, nuisances, prior).values(), _LEAST_EVIDENCE]) + _SAME
    nothing, found = _log_likelihood(solution, prior), None
    for late in (each for each in nuisances if each.kind == "time_s"):
        drift = Nuisance(late.subject, "drift_s", len(prior), 1)
        grown, padded = solution.with_growth(late.first), np.pad(allow_cause(prior, late), (0, 1))
        free = allow_cause(padded, drift)
        evidence = _log_likelihood(grown, free) - nothing
        if evidence > best and _is_clear(grown, drift, free):
            best, found = evidence, (drift, grown, free)
    return found


def _evidence(solution: NuisanceSolution, nuisances: Sequence[Nuisance], prior: Array) -> dict[Nuisance, float]:
    """Return by how much each cause alone makes the pictures likelier [nats], its freedom penalised."""
    base = _log_likelihood(solution, prior)
    return {n: _log_likelihood(solution, allow_cause(prior, n)) - base for n in nuisances}


def _log_likelihood(solution: NuisanceSolution, prior: Array) -> float:
    """Return the logarithm of the marginal likelihood, less what does not depend on the prior."""
    misfit = solution.posterior(prior)[2]
    occam = np.linalg.slogdet(np.eye(len(prior)) + prior @ solution.H)[1]
    return -0.5 * (misfit + float(occam))


def _is_clear(solution: NuisanceSolution, nuisance: Nuisance, prior: Array) -> bool:
    value, sd = _size(solution, nuisance, prior)
    return abs(value) > ALARM_SDS * sd


def _size(solution: NuisanceSolution, nuisance: Nuisance, prior: Array) -> tuple[float, float]:
    """Return a cause's value and sd, in degrees for a turn; of three numbers the norm."""
    theta, covariance, _ = solution.posterior(prior)
    mean, block = theta[nuisance.columns], covariance[nuisance.columns, nuisance.columns]
    value = float(mean[0]) if nuisance.size == 1 else float(np.linalg.norm(mean))
    direction = mean / max(np.linalg.norm(mean), 1e-12) if nuisance.size > 1 else np.ones(1)
    by_blocks = solution.jackknife(prior)[nuisance.columns, nuisance.columns]
    variance = max(float(direction @ block @ direction), float(direction @ by_blocks @ direction), 0.0)
    sd = np.sqrt(variance + _MODEL_SD[nuisance.kind] ** 2 + (_MODEL_SHARE[nuisance.kind] * value) ** 2)
    factor = {"turn_deg": np.degrees(1.0), "drift_s": _WHOLE_RUN}.get(nuisance.kind, 1.0)
    return float(factor * value), float(factor * sd)


def _describe(subject: str, kind: Kind, value: float, sd: float) -> str:
    size = abs(value)
    if kind == "scale":
        what, than = ("body", "its model") if subject == "body" else ("world", "the calibration")
        return f"the {what} looks {100 * size:.1f} ± {100 * sd:.1f} % {_larger(value)} than {than} says"
    if kind == "turn_deg":
        return f"camera {subject} seems turned by {size:.2f} ± {sd:.2f}°"
    if kind == "shift_m":
        return f"camera {subject} seems to stand {1e3 * size:.0f} ± {1e3 * sd:.0f} mm beside its place"
    if kind == "focal":
        how = "longer" if value > 0 else "shorter"
        return (
            f"the focal length of {subject} seems {100 * size:.1f} ± {100 * sd:.1f} % {how} than the calibration says"
        )
    if kind == "drift_s":
        how = "later and later" if value > 0 else "earlier and earlier"
        return (
            f"camera {subject} seems {how}, by {1e3 * size:.0f} ± {1e3 * sd:.0f} ms over the run: its frame rate seems "
            "to be another than its video states"
        )
    return f"camera {subject} seems {1e3 * size:.1f} ± {1e3 * sd:.1f} ms {'late' if value > 0 else 'early'}"


def _larger(value: float) -> str:
    return "larger" if value > 0 else "smaller"
