"""Ours and the peers as tuners of one objective on the unit box, each with an exact budget of evaluations.

A method is called as `method(score, start, seed, budget)`: `score` takes a point of the unit box and raises `Spent`
once the budget is used, `start` is a point or None for a cold start. Settings are those that a user of the package
would begin with; `start` is told to whoever can be told.
"""

import json
import os
import subprocess
import tempfile
import warnings
from typing import Callable, NamedTuple

import numpy as np
import optuna
import scipy.optimize

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that there is no matplotlib
    import cma

# A candidate that failed: above every score, and the peers but compare scores.
FAILED = 1e3


class Spent(Exception):
    """Every evaluation of the budget is used."""


class Counted:
    """An objective that counts, keeps the best score after each evaluation, and ends a search exactly on its budget."""

    def __init__(self, objective, budget):
        self.objective, self.budget = objective, budget
        self.dimension = len(objective.names)
        self.best = []

    def __call__(self, point):
        return self.score(self.objective.gains(np.clip(np.asarray(point, float), 0.0, 1.0)))

    def score(self, gains):
        if len(self.best) >= self.budget:
            raise Spent
        found = self.objective.score(gains)
        self.best.append(min([found, *self.best[-1:]]))
        return found


def first(score, start, seed):
    """Where a method begins that needs a point: the start, or a random one."""
    return np.array(start) if start is not None else np.random.default_rng(1000 + seed).random(score.dimension)


def pycma(score, start, seed, budget):
    """CMA-ES with BIPOP restarts at random points."""
    draw = np.random.default_rng(77 + seed)
    given = [first(score, start, seed)]

    def begin():
        return given.pop() if given else draw.random(score.dimension)

    sigma = 0.25 if start is None else 0.15
    options = {"bounds": [0, 1], "seed": seed + 1, "verbose": -9, "verb_log": 0, "maxfevals": budget + 1}
    cma.fmin2(score, begin, sigma, options, restarts=9, bipop=True)


def study(score, start, sampler):
    """What all samplers of Optuna have in common."""
    names = [f"x{i}" for i in range(score.dimension)]
    trials = optuna.create_study(sampler=sampler)
    if start is not None:
        trials.enqueue_trial(dict(zip(names, map(float, start))))
    while True:
        trial = trials.ask()
        trials.tell(trial, score([trial.suggest_float(name, 0, 1) for name in names]))


def optuna_tpe(score, start, seed, budget):
    study(score, start, optuna.samplers.TPESampler(seed=seed))


def optuna_cma(score, start, seed, budget):
    x0 = None if start is None else {f"x{i}": float(x) for i, x in enumerate(start)}
    study(score, start, optuna.samplers.CmaEsSampler(x0=x0, seed=seed))


def scipy_de(score, start, seed, budget):
    """Differential evolution; a small budget takes the smallest population, so that there are generations at all."""
    box = [(0, 1)] * score.dimension
    size = 5 if budget <= 200 else 10
    scipy.optimize.differential_evolution(
        score, box, x0=start, popsize=size, maxiter=10**6, tol=0, polish=False, rng=np.random.default_rng(seed)
    )


def scipy_simplex(score, start, seed, budget):
    """Nelder-Mead, and from a random point again whenever it has converged."""
    draw = np.random.default_rng(5 + seed)
    dimension = score.dimension
    at = first(score, start, seed)
    while True:
        edges = np.diag(np.where(at > 0.5, -0.15, 0.15))
        options = {"initial_simplex": np.vstack([at, at + edges]), "adaptive": True, "maxfev": 10**6}
        options |= {"xatol": 1e-4, "fatol": 1e-5}
        scipy.optimize.minimize(score, at, method="Nelder-Mead", bounds=[(0, 1)] * dimension, options=options)
        at = draw.random(dimension)


def nevergrad_ngopt(score, start, seed, budget):
    import nevergrad  # slow to import, and only one of the two comparisons asks for it

    begin = np.full(score.dimension, 0.5) if start is None else np.array(start)
    box = nevergrad.p.Array(init=begin, lower=0, upper=1)
    box.random_state.seed(seed)
    search = nevergrad.optimizers.NGOpt(parametrization=box, budget=budget)
    if start is not None:
        search.suggest(begin)
    while True:
        candidate = search.ask()
        search.tell(candidate, score(candidate.value))


def ours(score, start, seed, budget):
    """`autotune ask-tell` over the objective's own space; the scores are told as they are."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write(score.objective.space(cold=start is None))
        file.flush()
        words = [os.environ["AUTOTUNE"], "ask-tell", "--space", file.name, "--seed", str(seed), "--budget", str(budget)]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as search:
            for line in search.stdout:
                said = json.loads(line)
                if "ask" not in said:
                    break
                found = score.score(said["ask"]["gains"])
                answer = {"score": found} if found < FAILED else {"failed": True}
                search.stdin.write(json.dumps({"tell": {"id": said["ask"]["id"], **answer}}) + "\n")
            search.stdin.close()
    if "done" not in said:
        raise RuntimeError(f"ask-tell: {said}")


class Method(NamedTuple):
    """What is run, and whether what it does depends on the budget."""

    search: Callable
    looks_at_budget: bool


OURS = "autotune ask-tell"
METHODS = {
    OURS: Method(ours, True),
    "pycma BIPOP": Method(pycma, False),
    "Optuna TPE": Method(optuna_tpe, False),
    "Optuna CMA-ES": Method(optuna_cma, False),
    "SciPy DE": Method(scipy_de, True),
    "SciPy Nelder-Mead, restarts": Method(scipy_simplex, False),
    "Nevergrad NGOpt": Method(nevergrad_ngopt, True),
}


def run(name, objective, start, seed, budget):
    """The best score after each of `budget` evaluations."""
    warnings.filterwarnings("ignore")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    score = Counted(objective, budget)
    try:
        METHODS[name].search(score, start, seed, budget)
    except Spent:
        pass
    if len(score.best) != budget:
        raise RuntimeError(f"{name} stopped after {len(score.best)} of {budget} evaluations")
    return score.best
