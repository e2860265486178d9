"""Random settings: each is refused by name, or whole bang-bang episodes of it keep account of every joule."""

import re
from collections import Counter

import numpy as np
import pytest

from elbow_gym import Conditions, ElbowArmEnv, Simulator, TableParameters, contact
from elbow_gym.kernel.rows import PARAMETERS
from tests.support.arms import inductor_energy, mechanical_energy, started, uneven_arm
from tests.support.random_settings import draw

SEED = 22
BALANCE = 1e-3
"""Largest part of the energy that was drawn and lost that may be missing [-]."""
TOLD = 1e-6
"""Constraint residual from which on infos say that motion and energy are not to be trusted [m/s^2]."""


def stored_energy(sim):
    """Kinetic, potential, elastic and magnetic energy of each arm above its lowest potential energy [J], (B,)."""
    row = dict(zip(PARAMETERS, np.moveaxis(sim.parameters(np.arange(sim.num_envs)), 1, 0), strict=True))
    mass, length, load = row["mass"][:, 1:], row["length"][:, 1:], row["payload"][:, 0]
    phi, omega, psi_dot = np.cumsum(sim.q[:, 1:], 1), np.cumsum(sim.q_dot[:, 1:], 1), sim.q_dot[:, :1]
    sine, cosine = length * np.sin(phi), length * np.cos(phi)
    # Of every link's end and, half of the link before it, its middle.
    rho, z = np.cumsum(sine, 1), np.cumsum(cosine, 1)
    rho_dot, z_dot = np.cumsum(cosine * omega, 1), -np.cumsum(sine * omega, 1)
    middle = (rho - sine / 2.0, rho_dot - cosine * omega / 2.0, z_dot + sine * omega / 2.0)
    axial, difference = row["axial_inertia"][:, 1:], row["inertia_difference"][:, 1:]
    turning = (axial + difference) * omega**2 + (axial + difference * np.sin(phi) ** 2) * psi_dot**2
    moving = mass * (middle[1] ** 2 + middle[2] ** 2 + (middle[0] * psi_dot) ** 2)
    carried = load * (rho_dot[:, -1] ** 2 + z_dot[:, -1] ** 2 + (rho[:, -1] * psi_dot[:, 0]) ** 2)
    rotors = (row["reflected_inertia"] * sim.q_dot**2).sum(1) + row["axial_inertia"][:, 0] * psi_dot[:, 0] ** 2
    lowest = np.cumsum(length, 1)
    raised = (mass * (z - cosine / 2.0 + lowest - length / 2.0)).sum(1) + load * (z[:, -1] + lowest[:, -1])
    elastic = (row["stiffness"][:, 1:] * np.minimum(z, 0.0) ** 2).sum(1) * (sim.conditions.surface is not None)
    magnetic = (sim.current**2 / row["inverse_inductance"]).sum(1)
    kinetic = (turning + moving).sum(1) + carried + rotors
    return (kinetic + elastic + magnetic) / 2.0 + row["gravity"][:, 0] * raised


def test_stored_energy_is_that_of_the_printed_equations_and_zero_in_an_arm_that_hangs():
    sim = Simulator(uneven_arm(), 0, conditions=Conditions(table=True), timestep=1e-4)
    started(sim)
    hanging = Simulator(uneven_arm(), 0, conditions=Conditions(table=True), timestep=1e-4)
    hanging.reset(np.pi * np.eye(10)[1])
    depth = np.cumsum(sim.arm.of_links("length")[1:])
    elastic = TableParameters().stiffness * (depth**2).sum() / 2.0
    assert stored_energy(hanging)[0] == pytest.approx(elastic, rel=1e-12)
    wanted = mechanical_energy(sim) - mechanical_energy(hanging) + inductor_energy(sim).sum()
    wanted += contact.contact_energy(sim.arm, sim.conditions.surface, sim.q[0]).sum()
    assert stored_energy(sim)[0] == pytest.approx(wanted, rel=1e-12)


def outcome(seed, on=None, decades=2.0):
    """What became of a setting: "refused", "told" that it is not to be trusted, "right", or what was wrong."""
    rng = np.random.default_rng((SEED, seed))
    arguments, parameters = draw(rng, decades, on)
    try:
        env = ElbowArmEnv(**arguments)
        env.reset(seed=seed, options={"parameters": parameters} if parameters else None)
    except ValueError as error:
        return "refused" if re.match(r"^(a control period|[a-z_]+(\[.*?\])?( \w+)?) must ", str(error)) else str(error)
    sim, price = env.episodes.simulator, env.settings.energy_weight * env.settings.control_frequency
    before, total, action = stored_energy(sim)[0], 0.0, rng.choice([-1.0, 1.0], env.action_space.shape)
    for period in range(env.settings.horizon):
        _, reward, terminated, _, info = env.step(action.astype(np.float32))
        total += reward
        if info["constraint_residual"] > TOLD:
            return "told"
        if terminated:
            return f"terminated in period {period}"
        # Signs that stay for two periods on average let joints speed up.
        action = np.where(rng.random(action.shape) < 0.5, action, -action)
    lost = (sim.copper_loss.sum(1) + sim.friction_loss.sum(1) + sim.contact_loss.sum(1))[0]
    scale = max(info["drawn_energy"] + lost, 1e-9)
    missing = info["electrical_energy"] - lost - (stored_energy(sim)[0] - before)
    if abs(missing) > BALANCE * scale:
        return f"{missing / scale:.1e} of the energy missing"
    if total > price * (before + BALANCE * scale):
        return f"a return of {total:.3g} from {before:.3g} J"
    return "right"


def wrong(outcomes):
    """Outcomes that are neither right nor refused nor told, by the setting's number."""
    return {seed: found for seed, found in outcomes.items() if found not in {"right", "refused", "told"}}


# Rubbing elbows 3 and 5 pass a pose in which the two links between them are folded and upright. Their forces have no
# bound there, friction that goes with them is not resolved by any step, and the residual does not tell.
NOT_MENDED = {698, 1153}

# Kernels that other tests have compiled, too.
COMPILED = {"the paper's arm": (), "table": ("table",), "everything": ("table", "rubbing", "heat", "supply", "payload")}


@pytest.mark.parametrize("on", COMPILED)
def test_a_few_random_settings_are_refused_or_right(on):
    # Where elbows can rub there must be some, for without any of them the kernel is another one.
    rubs = "rubbing" in COMPILED[on]
    drawn = (draw(np.random.default_rng((SEED, seed)), on=COMPILED[on]).arguments for seed in range(30))
    seeds = [seed for seed, arguments in enumerate(drawn) if arguments["elbows"] or not rubs][:10]
    outcomes = {seed: outcome(seed, COMPILED[on]) for seed in seeds}
    assert not wrong(outcomes)
    assert Counter(outcomes.values())["right"] >= 6


@pytest.mark.slow
@pytest.mark.soak
def test_two_thousand_random_settings_are_refused_by_name_or_right():
    outcomes = {seed: outcome(seed) for seed in range(2000)}
    assert set(wrong(outcomes)) <= NOT_MENDED
    count = Counter(outcomes.values())
    assert count["right"] >= 1500
    assert count["told"] <= 60
