"""Makes the golden traces: `python tests/make_golden.py`.

The one script that writes tests/golden/. A trace that changes is a change of the physics as users see it and
needs a line in CHANGELOG.md that says why.
"""

from pathlib import Path

import numpy as np

from elbow_gym import Simulator

GOLDEN = Path(__file__).parent / "golden"
ELBOWS = (0, 1, 2)


def trace(elbows):
    """Two paper arms, 200 timesteps of 2 ms under seeded voltages that change every ten: state and summary of each."""
    sim = Simulator("paper", elbows, 2, timestep=0.002)
    sim.reset()
    voltages = np.random.default_rng(elbows).uniform(-24.0, 24.0, (20, 2, 10))
    moments = []
    for voltage in voltages:
        sim.step(voltage, 10)
        moments.append(sim.get_state())
    return {"voltage": voltages} | {name: np.stack([moment[name] for moment in moments]) for name in moments[0]}


def main():
    GOLDEN.mkdir(exist_ok=True)
    for elbows in ELBOWS:
        np.savez_compressed(GOLDEN / f"elbows_{elbows}.npz", **trace(elbows))
    print(f"Wrote {len(ELBOWS)} traces to {GOLDEN}. If one changed, say why in CHANGELOG.md.")


if __name__ == "__main__":
    main()
