"""One descent, three rules: they end in SciPy's minimum, and say why they ended."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares

from airborne.geometry.descent import BacktrackingRule, MarquardtRule, NielsenRule, Outcome, descend
from tests.support.tolerances import EXACT, SOLVED

MARQUARDT = MarquardtRule(first=1e-3, down=5, up=4, least=1e-9, most=1e8)
NIELSEN = NielsenRule(first=1e-3, least=1e-12, most=1e8, least_factor=0.1)
BACKTRACKING = BacktrackingRule(factor=0.4, least=1e-3)
EVERY = pytest.mark.parametrize("rule", [MARQUARDT, NIELSEN, BACKTRACKING], ids=lambda rule: type(rule).__name__)


def residuals(x):
    """Rosenbrock's valley, and a weak third number."""
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0], 0.1 * (x[2] - np.sin(x[0])) - 0.05])


@dataclass(frozen=True)
class Iterate:
    x: np.ndarray
    damps: bool
    sign: float = 1.0  # -1: steps lead uphill

    def cost(self, reference):
        return float(residuals(self.x) @ residuals(self.x)) / 2

    def step(self, value):
        h = 1e-6 * np.eye(len(self.x))
        J = np.array([(residuals(self.x + e) - residuals(self.x - e)) / 2e-6 for e in h]).T
        A, g = J.T @ J, -J.T @ residuals(self.x)
        step = np.linalg.solve(A + (value * np.diag(np.diag(A)) if self.damps else 0), g) * (1 if self.damps else value)
        return self.x + self.sign * step, float(g @ step - step @ A @ step / 2)


def run(rule, start, sign=1.0, **settings):
    damps = not isinstance(rule, BacktrackingRule)
    first = Iterate(np.array(start, float), damps, sign)
    return descend(first, lambda x: Iterate(x, damps, sign), rule, **settings)


@EVERY
@pytest.mark.parametrize("start", [(-1.2, 1.0, 0.0), (2.0, -1.0, 3.0), (0.0, 0.0, 0.0)])
def test_descent_ends_in_scipys_minimum(rule, start):
    end = run(rule, start, most_steps=200, least_predicted=(1e-16, 0.0))
    assert end.outcome is Outcome.CONVERGED
    np.testing.assert_allclose(end.best.x, least_squares(residuals, start, xtol=1e-12).x, atol=SOLVED)


@EVERY
def test_every_gain_makes_the_cost_smaller(rule):
    told = []
    end = run(rule, (-1.2, 1.0, 0.0), most_steps=200, least_gain=1e-9, progress=lambda n, cost: told.append((n, cost)))
    steps, costs = zip(*told, strict=True)
    assert list(steps) == sorted(set(steps)) and steps[-1] <= end.n_steps
    assert all(later < before for before, later in pairwise(costs))
    assert costs[-1] == end.best.cost(end.best)


@EVERY
def test_a_descent_that_is_cut_short_says_so(rule):
    end = run(rule, (-1.2, 1.0, 0.0), most_steps=2, least_predicted=(1e-16, 0.0))
    assert (end.outcome, end.n_steps) == (Outcome.OUT_OF_STEPS, 2)


@EVERY
def test_a_descent_that_only_leads_uphill_is_stuck_where_it_began(rule):
    end = run(rule, (-1.2, 1.0, 0.0), sign=-1.0, most_steps=200)
    assert end.outcome is Outcome.STUCK
    assert end.n_losses == end.n_steps > 0
    np.testing.assert_array_equal(end.best.x, [-1.2, 1.0, 0.0])


def test_within_the_slack_a_larger_cost_is_a_gain():
    start = (1.0, 1.0, np.sin(1.0) + 0.5)  # the minimum
    assert run(BACKTRACKING, start, most_steps=1).n_losses == 1
    assert run(BACKTRACKING, (1.001, 1.0, 0.0), sign=-0.001, most_steps=1, slack=0.1).n_losses == 0


def test_nielsens_damping_follows_the_gain_and_doubles_its_growth_from_loss_to_loss():
    assert NIELSEN.after_gain(1.0, 1.0) == pytest.approx(0.1, rel=EXACT)
    assert NIELSEN.after_gain(1.0, 0.5) == pytest.approx(1.0, rel=EXACT)
    assert NIELSEN.after_gain(1.0, 0.0) == pytest.approx(2.0, rel=EXACT)
    assert [NIELSEN.after_loss(1.0, n) for n in (1, 2, 3)] == [2.0, 4.0, 8.0]
