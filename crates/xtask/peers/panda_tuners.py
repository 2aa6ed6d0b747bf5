"""Ours and the peers as tuners of the project's own objective, the built-in task on the Panda: one table, from one run.

    AUTOTUNE=PROGRAM panda_tuners.py

Every method searches the five gains of tuning/spaces/panda-aic.toml and gets its costs, settling times in s, from
`autotune evaluate --robot panda`, the same plants and limits for all.
"""

import functools
import json
import math
import os
import subprocess
import tomllib
from pathlib import Path

import numpy as np

from tuner_methods import OURS
from tuner_table import Row, Setting, compare

TUNING = Path(__file__).parents[3] / "tuning"
SPACE = (TUNING / "spaces/panda-aic.toml").read_text(encoding="utf-8")
PRESET = (TUNING / "presets/pezzato2020-simulation.toml").read_text(encoding="utf-8")
# A move lasts some seconds, and so does the longest settling time.
ABOVE_COSTS = 100.0
START = 'start = "pezzato2020-simulation"'

SETTINGS = [Setting(300, True, (None, None)), Setting(1000, True, (None, None))]
PEERS = ["pycma BIPOP", "Optuna TPE", "Optuna CMA-ES", "SciPy DE", "SciPy Nelder-Mead, restarts"]


@functools.cache
def evaluator():
    """The program that knows the objective; one for each of our processes, it ends with them."""
    words = [os.environ["AUTOTUNE"], "evaluate", "--robot", "panda"]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)


def told(answer):
    """What every method is told of a line of `autotune evaluate`: the cost, or for gains that have none, because they
    break a limit, are unstable or ran away, a number above every cost, in the order of their scores."""
    if not answer:
        raise RuntimeError("autotune evaluate ended without an answer; its own message stands above")
    found = json.loads(answer)
    if "error" in found:
        raise RuntimeError(f"autotune evaluate: {found['error']}")
    return found["cost"] if found["cost"] is not None else ABOVE_COSTS + found["score"]


class PandaGains:
    """The objective over the unit box of the space's free gains, all of them on logarithmic scales."""

    def __init__(self):
        space, published = tomllib.loads(SPACE), tomllib.loads(PRESET)["aic"]
        self.fixed, ranges = space["fixed"], space["gains"]
        if any(entry["scale"] != "log" for entry in ranges.values()):
            raise RuntimeError("the space has a gain on a linear scale; expected logarithmic ones")
        self.names = list(ranges)
        self.lower = np.array([math.log(ranges[name]["lower"]) for name in self.names])
        self.upper = np.array([math.log(ranges[name]["upper"]) for name in self.names])
        logs = np.array([math.log(published[name]) for name in self.names])
        self.published = (logs - self.lower) / (self.upper - self.lower)

    def gains(self, point):
        values = np.exp(self.lower + point * (self.upper - self.lower))
        return {**self.fixed, **dict(zip(self.names, values.tolist()))}

    def score(self, gains):
        program = evaluator()
        program.stdin.write(json.dumps({"gains": gains}) + "\n")
        return told(program.stdout.readline())

    def space(self, cold):
        if START not in SPACE:
            raise RuntimeError(f"the space does not say {START}")
        return SPACE.replace(START, 'start = "cold"') if cold else SPACE


if __name__ == "__main__":
    rows = [Row(name, name, PandaGains) for name in [OURS, *PEERS]]
    compare(rows, SETTINGS, figure=lambda score: score)
