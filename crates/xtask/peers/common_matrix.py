"""One Lyapunov matrix for several loops, by cvxpy and Clarabel: seconds of CPU time.

    common_matrix.py FILE   prints `common-matrix CPU_S`, all of cvxpy's work and Clarabel's, which is nearly all of it

FILE holds the rate, the number of matrices and their order, then their rows. The program: P >= I and
A'P + P A + 2 rate P <= -margin I for each A, with nothing to minimise, which is quicker than the least trace. The states are first brought to like sizes by powers of two, as ours are; that is not timed.
One thread, as ours. A matrix that does not serve is no figure.
"""

import sys
import time

import cvxpy as cp
import numpy as np
from scipy.linalg import matrix_balance


def read(path):
    with open(path, encoding="utf-8") as file:
        rate, count, order = file.readline().split()
        rows = np.loadtxt(file)
    return float(rate), rows.reshape(int(count), int(order), int(order))


def main():
    rate, loops = read(sys.argv[1])
    order = loops.shape[1]
    _, (scale, _) = matrix_balance(np.abs(loops).sum(axis=0), permute=False, separate=True)
    loops = loops * scale / scale[:, None]

    p = cp.Variable((order, order), symmetric=True)
    one = np.eye(order)
    constraints = [p >> one]
    for a in loops:
        constraints.append(a.T @ p + p @ a + 2 * rate * p << -1e-3 * np.linalg.norm(a) * one)
    problem = cp.Problem(cp.Minimize(0), constraints)
    start = time.process_time()
    problem.solve(solver=cp.CLARABEL, max_threads=1)
    spent = time.process_time() - start

    found = p.value
    definite = [found] + [-(a.T @ found + found @ a + 2 * rate * found) for a in loops]
    if problem.status != cp.OPTIMAL or min(np.linalg.eigvalsh(m).min() for m in definite) <= 0:
        sys.exit(f"no common matrix: {problem.status}")
    print(f"common-matrix {spent:.3f}")


main()
