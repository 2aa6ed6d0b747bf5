"""Ours and the peers as tuners of the objective in tuner_objective.py: one table, from one run.

    AUTOTUNE=PROGRAM tuners.py

Multiplying both kappas and all four sigmas by one number leaves the control law as it is. Ours asks that one of them
be fixed; the peers get all six, as a user would hand them over. Which value is fixed matters all the same, since the
bounds are those of six gains that may all be scaled: with sigma_q at its published 1 the best that is left lies on the
lower bound of sigma_mu (2.292e-3), with sigma_q = 10 the best of the six is inside (2.276e-3). Ours is run with both,
and so is pycma with the same five gains.
"""

import numpy as np

from tuner_methods import OURS
from tuner_objective import GAINS, HIGHEST, LOWER, LOWEST, PUBLISHED, UPPER, Objective
from tuner_table import Row, Setting, compare

HEAD = """schema = 1
controller = "aic"

[search]
method = "schedule"
{start}
[fixed]
sigma_q = {sigma_q!r}
reference_time_constant_s = 1.0
"""
RANGE = """
[gains.{}]
lower = {!r}
upper = {!r}
scale = "log"
"""
# What the first row should reach: the worst plant's cost, median and worst seed.
SETTINGS = [
    Setting(200, True, (2.32e-3, None)),
    Setting(1000, True, (2.28e-3, 2.32e-3)),
    Setting(1000, False, (2.28e-3, 2.32e-3)),
]
PEERS = ["pycma BIPOP", "Optuna TPE", "Optuna CMA-ES", "SciPy DE", "SciPy Nelder-Mead, restarts", "Nevergrad NGOpt"]


class SixGains:
    """The objective over the unit box of log-gains; all of them, unless sigma_q is fixed."""

    sigma_q = None

    def __init__(self):
        free = [i for i, name in enumerate(GAINS) if name != "sigma_q" or self.sigma_q is None]
        self.names = [GAINS[i] for i in free]
        self.lower, self.upper = LOWER[free], UPPER[free]
        # The published law, with all of its gains scaled like sigma_q.
        published = PUBLISHED[free] + np.log10(self.sigma_q or 1.0)
        self.published = (published - self.lower) / (self.upper - self.lower)
        self.objective = Objective()

    def gains(self, point):
        logs = self.lower + point * (self.upper - self.lower)
        return {"sigma_q": self.sigma_q, **dict(zip(self.names, 10.0**logs))}

    def score(self, gains):
        return self.objective(np.log10([gains[name] for name in GAINS]))

    def space(self, cold):
        ranges = [RANGE.format(*entry) for entry in zip(GAINS, LOWEST, HIGHEST) if entry[0] in self.names]
        return HEAD.format(start='start = "cold"\n' if cold else "", sigma_q=self.sigma_q) + "".join(ranges)


class FiveGains(SixGains):
    sigma_q = 10.0


class PublishedVariance(SixGains):
    sigma_q = 1.0


if __name__ == "__main__":
    rows = [Row(f"{OURS}, sigma_q = 10", OURS, FiveGains), Row(f"{OURS}, sigma_q = 1", OURS, PublishedVariance)]
    rows += [Row(name, name, SixGains) for name in PEERS]
    rows += [Row("pycma BIPOP, sigma_q = 10", "pycma BIPOP", FiveGains)]
    rows += [Row("pycma BIPOP, sigma_q = 1", "pycma BIPOP", PublishedVariance)]
    compare(rows, SETTINGS, figure=lambda score: 10.0**score)
