"""pycma's CMA-ES with BIPOP restarts on the problems of the bench `classics` of certune-search.

    search.py PROBLEMS.json RESULTS.csv   appends lines `function,dimension,seed,solved,evaluations`

What RESULTS.csv holds already is kept, so that a run that broke off goes on. Two processes, each run with one
thread. A run is solved at its first value below the target; one that is not counts as its whole budget.
"""

import csv
import json
import multiprocessing
import os
import sys
import warnings

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[threads] = "1"
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that there is no matplotlib
    import cma
import numpy as np

PROCESSES = 2
SIGMA = 0.2
TARGET = 1e-8


class Done(Exception):
    """The target is reached, or the budget is spent."""


def shape_of(name, dimension):
    """The function of z whose least value, at 0, is 0."""
    share = np.arange(dimension) / (dimension - 1)
    lengths, powers = 1e6**share, 2 + 4 * share
    discus = np.ones(dimension)
    discus[0] = 1e6

    def rosenbrock(z):
        a, b = z[:-1] + 1, z[1:] + 1
        return np.sum(100 * (a**2 - b) ** 2 + (a - 1) ** 2)

    return {
        "sphere": lambda z: z @ z,
        "ellipsoid": lambda z: lengths @ z**2,
        "rosenbrock": rosenbrock,
        "rastrigin": lambda z: np.sum(z**2 + 10 - 10 * np.cos(2 * np.pi * z)),
        "discus": lambda z: discus @ z**2,
        "powers": lambda z: np.sum(np.abs(z) ** powers),
    }[name]


def function(problem):
    """The function of x in the unit box that `problem` describes."""
    optimum, gradient = np.array(problem["optimum"]), np.array(problem["gradient"])
    rotation = np.array(problem["rotation"])
    shape = shape_of(problem["shape"], problem["dimension"])

    def value(x):
        off = 10 * np.asarray(x) - 5 - optimum
        return gradient @ off + shape(rotation @ off)

    return value


def solve(problem, seed):
    """Whether pycma reaches the target from the `seed`-th start, and after how many evaluations."""
    value, budget, count = function(problem), problem["budget"], 0

    def counted(x):
        nonlocal count
        count += 1
        result = value(x)
        if result < TARGET or count >= budget:
            raise Done(bool(result < TARGET))
        return result

    given = [np.array(problem["starts"][seed])]
    rng = np.random.default_rng(seed)

    def start():
        """The given start at first, then a random one for each restart."""
        return given.pop() if given else rng.random(problem["dimension"])

    options = {"bounds": [0, 1], "seed": 1000 + seed, "verbose": -9, "verb_log": 0}
    try:
        cma.fmin2(counted, start, SIGMA, options, restarts=9, bipop=True)
    except Done as done:
        return done.args[0], count
    return False, budget


def line(task):
    problem, seed = task
    solved, count = solve(problem, seed)
    return [problem["name"], str(problem["dimension"]), str(seed), str(int(solved)), str(count)]


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        problems = json.load(file)
    for problem in problems:
        x, expected = problem["probe"]
        if not abs(function(problem)(x) / expected - 1) < 1e-9:
            sys.exit(f"{problem['name']} in {problem['dimension']} dimensions is another function here")
    with open(sys.argv[2], "a+", newline="", encoding="utf-8") as file:
        file.seek(0)
        known = {tuple(row[:3]) for row in csv.reader(file)}
        tasks = [(problem, seed) for problem in problems for seed in range(len(problem["starts"]))]
        tasks = [(p, seed) for p, seed in tasks if (p["name"], str(p["dimension"]), str(seed)) not in known]
        out = csv.writer(file, lineterminator="\n")
        with multiprocessing.Pool(PROCESSES) as pool:
            for row in pool.imap_unordered(line, tasks):
                out.writerow(row)
                file.flush()


if __name__ == "__main__":
    warnings.filterwarnings("ignore")
    main()
