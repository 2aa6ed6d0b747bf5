"""A cheap objective with the structure of ours: one joint under the active inference controller, on eight masses.

The joint moves from 0 towards a goal of 0.5 rad for three seconds, by Euler's rule at 1 kHz, with the sensors' noise;
it has viscous friction 1 N m s/rad and a constant load. The cost of a plant is

    J = sum over k of h ((q - q_ref)^2 + 1e-6 (du/dt)^2),   q_ref = goal (1 - exp(-t / 1 s)),

100 to 200 when it runs away. The score is log10 of the worst plant's cost. Masses, loads and noise are drawn once
from a seed, so that it is a plain function of the six gains, and compiled, so that a candidate takes a millisecond.
"""

import math

import numpy as np
from numba import njit

# kappa_mu, kappa_a, and the variances of q, dq, mu, dmu, as everywhere in the project.
GAINS = ("kappa_mu", "kappa_a", "sigma_q", "sigma_dq", "sigma_mu", "sigma_dmu")
LOWEST = (0.1, 10.0, 0.01, 0.01, 0.05, 0.1)
HIGHEST = (1000.0, 1e5, 100.0, 100.0, 500.0, 1000.0)
LOWER, UPPER = np.log10(np.array(LOWEST)), np.log10(np.array(HIGHEST))
PUBLISHED = np.log10(np.array([11.67, 700.0, 1.0, 1.0, 5.0, 10.0]))

STEP_S = 0.001
DURATION_S = 3.0
GOAL_RAD = 0.5
REFERENCE_TIME_CONSTANT_S = 1.0
FRICTION = 1.0
TORQUE_RATE_WEIGHT = 1e-6


@njit(cache=True, fastmath=False)
def costs(gains, masses, loads, noise_q, noise_dq):
    """The cost of each plant; the order of the operations is part of the definition."""
    kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu = gains
    h = STEP_S
    steps = int(DURATION_S / h)
    found = np.zeros(masses.size)
    for i in range(masses.size):
        mass = masses[i]
        load = loads[i]
        q = 0.0
        dq = 0.0
        u = 0.0
        mu = 0.0
        dmu = 0.0
        ddmu = 0.0
        cost = 0.0
        for k in range(steps):
            y = q + noise_q[i, k]
            dy = dq + noise_dq[i, k]
            reference = GOAL_RAD * (1 - math.exp(-k * h / REFERENCE_TIME_CONSTANT_S))
            error_mu = (dmu + mu - GOAL_RAD) / sigma_mu
            error_dmu = (ddmu + dmu) / sigma_dmu
            mu_rate = dmu - kappa_mu * (-(y - mu) / sigma_q + error_mu)
            dmu_rate = ddmu - kappa_mu * (-(dy - dmu) / sigma_dq + error_mu + error_dmu)
            ddmu_rate = -kappa_mu * error_dmu
            u_rate = -kappa_a * ((dy - dmu) / sigma_dq + (y - mu) / sigma_q)
            acceleration = (u - FRICTION * dq + load) / mass
            cost += h * ((q - reference) ** 2 + TORQUE_RATE_WEIGHT * u_rate * u_rate)
            q += h * dq
            dq += h * acceleration
            u += h * u_rate
            mu += h * mu_rate
            dmu += h * dmu_rate
            ddmu += h * ddmu_rate
            if not (abs(q) < 10.0) or not (abs(u) < 1e4) or not (abs(mu) < 1e3) or not (abs(dmu) < 1e4):
                cost = 100.0 * (1.0 + (steps - k) / steps)
                break
        found[i] = min(cost, 200.0)
    return found


class Objective:
    """The score of a point, log10 of each gain in the order of GAINS; what lies outside the bounds counts as on them."""

    def __init__(self, seed=1234, plants=8):
        draw = np.random.default_rng(seed)
        steps = int(DURATION_S / STEP_S)
        self.masses = np.exp(draw.uniform(math.log(0.3), math.log(3.0), plants))
        self.loads = -self.masses * draw.uniform(0.5, 3.0, plants) * 0.2
        self.noise_q = draw.normal(0, 1e-4, (plants, steps))
        self.noise_dq = draw.normal(0, 2e-3, (plants, steps))

    def __call__(self, point):
        gains = 10.0 ** np.clip(np.asarray(point, float), LOWER, UPPER)
        worst = costs(gains, self.masses, self.loads, self.noise_q, self.noise_dq).max()
        return float(math.log10(worst))
