"""Runs tuners on an objective from several seeds, and prints the best that each found, ours beside its peers.

An objective has the `names` of its free gains, the `published` point (of the unit box), and three functions:
`gains(point)`, `score(gains)`, lower is better, and `space(cold)`, the text of its search space.
"""

import multiprocessing
import statistics
from typing import NamedTuple

from tuner_methods import METHODS, run

SEEDS = range(5)
PROCESSES = 2


class Row(NamedTuple):
    """A method, and what makes the objective that it is given."""

    title: str
    method: str
    objective: type


class Setting(NamedTuple):
    """A budget of evaluations, whether the published gains are told, and what ours should reach: median and worst seed."""

    budget: int
    warm: bool
    aims: tuple


def one(task):
    method, objective, warm, seed, budget = task
    made = objective()
    return task, run(method, made, made.published if warm else None, seed, budget)


def compare(rows, settings, figure):
    """Runs everything and prints the table; `figure` turns a score into the number to print. Ours is the first row.

    A method that does not look at its budget is run once, with the largest: what it had found earlier is its answer
    to a smaller one.
    """
    largest = {warm: max(s.budget for s in settings if s.warm == warm) for warm in (s.warm for s in settings)}

    def task(row, setting, seed):
        looks = METHODS[row.method].looks_at_budget
        return row.method, row.objective, setting.warm, seed, setting.budget if looks else largest[setting.warm]

    tasks = {task(row, setting, seed) for row in rows for setting in settings for seed in SEEDS}
    with multiprocessing.Pool(PROCESSES) as pool:
        found = dict(pool.imap_unordered(one, tasks))

    def cell(row, setting):
        """Median and worst over the seeds."""
        best = [figure(found[task(row, setting, seed)][setting.budget - 1]) for seed in SEEDS]
        return statistics.median(best), max(best)

    def line(title, cells):
        print(f"{title:<32}" + "".join(f" {median:>12} {worst:>9}" for median, worst in cells), flush=True)

    print(f"\nbest after so many evaluations, median and worst of {len(SEEDS)} seeds")
    line("", [(f"{s.budget:,}", "published" if s.warm else "cold") for s in settings])
    line("", [("median", "worst")] * len(settings))
    for row in rows:
        line(row.title, [(f"{median:.4g}", f"{worst:.4g}") for median, worst in (cell(row, s) for s in settings)])
    line("aim of ours", [[f"{aim:.4g}" if aim else "" for aim in s.aims] for s in settings])
    for s in settings:
        for what, reached, aim in zip(("median", "worst"), cell(rows[0], s), s.aims):
            if aim and not reached <= aim:
                print(f"not met: {what} {reached:.4g} after {s.budget:,} {'published' if s.warm else 'cold'}, aim {aim:.4g}")
