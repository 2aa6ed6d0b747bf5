"""Ours and the peers as tuners of the objective in tuner_objective.py: one table, from one run.

    AUTOTUNE=PROGRAM tuners.py

Multiplying both kappas and all four sigmas by one number leaves the control law as it is. Ours asks that one of them
be fixed, here sigma_q at its published 1; the peers get all six, as a user would hand them over, and pycma the same
five as well.
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
sigma_q = 1.0
reference_time_constant_s = 1.0
"""
RANGE = """
[gains.{}]
lower = {!r}
upper = {!r}
scale = "log"
"""
# What ours should reach: the worst plant's cost, median and worst seed.
SETTINGS = [
    Setting(200, True, (2.32e-3, None)),
    Setting(1000, True, (2.28e-3, 2.32e-3)),
    Setting(1000, False, (2.28e-3, 2.32e-3)),
]
PEERS = ["pycma BIPOP", "Optuna TPE", "Optuna CMA-ES", "SciPy DE", "SciPy Nelder-Mead, restarts", "Nevergrad NGOpt"]


class Gains:
    """The objective over the unit box of log-gains, but for those that are `fixed` at their published values."""

    fixed = ()

    def __init__(self):
        self.names = [name for name in GAINS if name not in self.fixed]
        free = [GAINS.index(name) for name in self.names]
        self.lower, self.upper = LOWER[free], UPPER[free]
        self.published = (PUBLISHED[free] - self.lower) / (self.upper - self.lower)
        self.objective = Objective()

    def gains(self, point):
        logs = self.lower + point * (self.upper - self.lower)
        return dict(zip(self.names, 10.0**logs))

    def score(self, gains):
        at = [np.log10(gains[name]) if name in gains else PUBLISHED[i] for i, name in enumerate(GAINS)]
        return self.objective(at)

    def space(self, cold):
        ranges = [RANGE.format(*entry) for entry in zip(GAINS, LOWEST, HIGHEST) if entry[0] in self.names]
        return HEAD.format(start='start = "cold"\n' if cold else "") + "".join(ranges)


class FiveGains(Gains):
    fixed = ("sigma_q",)


if __name__ == "__main__":
    rows = [Row(OURS, OURS, FiveGains)]
    rows += [Row(name, name, Gains) for name in PEERS]
    rows.append(Row("pycma BIPOP, the same 5 gains", "pycma BIPOP", FiveGains))
    compare(rows, SETTINGS, figure=lambda score: 10.0**score)
