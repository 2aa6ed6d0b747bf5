"""Our search, your simulator: gains for a joint that only this script knows.

    cargo build --release
    python3 examples/09_ask_tell.py target/release/autotune

`autotune ask-tell` asks for the score of gains, a JSON line each; this script tells it. `cargo test -p autotune` runs it too.
"""

import json
import math
import subprocess
import sys

STEP_S = 1e-3
GOAL_RAD = 1.0


def score(gains):
    """Time-weighted error (rad s²) of a move of 1 rad: a joint of 0.8 kg m² with friction, whose load pulls by up to 12 N m."""
    precision = {name: 1 / gains[name] for name in ("sigma_q", "sigma_dq", "sigma_mu", "sigma_dmu")}
    q = dq = mu = dmu = ddmu = u = itae = 0.0
    for step in range(4000):
        # The active inference controller, as in the rustdoc of `certune_control::aic`, with a reference of 1 s.
        of_mu = (dmu + mu - GOAL_RAD) * precision["sigma_mu"]
        of_dmu = (ddmu + dmu) * precision["sigma_dmu"]
        down = [of_mu - (q - mu) * precision["sigma_q"], of_mu + of_dmu - (dq - dmu) * precision["sigma_dq"], of_dmu]
        mu += STEP_S * (dmu - gains["kappa_mu"] * down[0])
        dmu += STEP_S * (ddmu - gains["kappa_mu"] * down[1])
        ddmu -= STEP_S * gains["kappa_mu"] * down[2]
        u -= STEP_S * gains["kappa_a"] * ((q - mu) * precision["sigma_q"] + (dq - dmu) * precision["sigma_dq"])
        # The joint.
        dq += STEP_S * (u - 1.5 * dq - 12.0 * math.cos(q)) / 0.8
        q += STEP_S * dq
        if not abs(q) < 20:
            raise ArithmeticError("the joint runs away")
        itae += STEP_S * (step * STEP_S) * abs(q - GOAL_RAD)
    return itae


def main(autotune):
    command = [autotune, "ask-tell", "--budget", "80", "--seed", "1"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as search:
        scores, failures = {}, 0
        for line in search.stdout:
            message = json.loads(line)
            if "done" in message:
                done = message["done"]
                continue
            tell = {"id": message["ask"]["id"]}
            try:
                tell["score"] = scores[tell["id"]] = score(message["ask"]["gains"])
            except ArithmeticError:
                tell["failed"] = True
                failures += 1
            search.stdin.write(json.dumps({"tell": tell}) + "\n")
    best = done["best"]
    print(f"{done['evaluations']} candidates, {failures} ran away")
    print(f"{scores[0]:.4f} rad s² with the published gains, {best['score']:.4f} with\n{json.dumps(best['gains'], indent=1)}")

    assert search.returncode == 0 and done["evaluations"] == 80 == len(scores) + failures
    # The first question is about the gains that the search starts from; the answer is the best that was told, to the bit.
    assert best["score"] == min(scores.values()) == score(best["gains"])
    assert best["score"] < 0.9 * scores[0], "a tenth less than with the published gains, at least"


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "autotune")
