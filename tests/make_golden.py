"""Makes the golden traces and the golden picture: `python tests/make_golden.py`.

The one script that writes tests/golden/ and elbow_gym/golden.json. A trace that changes is a change of the
physics as users see it and needs a line in CHANGELOG.md that says why; so does a picture that looks different.
"""

import json
from pathlib import Path

import numpy as np
from PIL import Image

from elbow_gym import ElbowArmEnv, Simulator
from elbow_gym.verification import GOLDEN as HASHES
from elbow_gym.verification import ROLLOUTS, rollout

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
    kept = ("state", "summary", "clock")
    return {"voltage": voltages} | {name: np.stack([moment[name] for moment in moments]) for name in kept}


def picture():
    """What a small picture shows of the paper's arm after 0.4 s of seeded voltages."""
    env = ElbowArmEnv(render_mode="rgb_array", render_width=320, render_height=240)
    env.reset(seed=5)
    for action in np.random.default_rng(5).uniform(-0.3, 0.3, (20, 10)):
        env.step(action)
    return env.render()


def main():
    GOLDEN.mkdir(exist_ok=True)
    for elbows in ELBOWS:
        np.savez_compressed(GOLDEN / f"elbows_{elbows}.npz", **trace(elbows))
    hashes = {name: rollout(arguments) for name, arguments in ROLLOUTS.items()}
    HASHES.write_text(json.dumps(hashes, indent=2) + "\n")
    Image.fromarray(picture()).save(GOLDEN / "picture.png", optimize=True)
    print(f"Wrote {len(ELBOWS)} traces and a picture to {GOLDEN}. If one changed, say why in CHANGELOG.md.")


if __name__ == "__main__":
    main()
