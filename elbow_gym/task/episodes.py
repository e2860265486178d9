"""Episodes of B arms side by side, the engine of both the single and the batched environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import as_dict, require_entries
from elbow_gym.kernel.rows import FIGURES, PAID, PARAMETERS, RESIDUAL, SUMMARY_COLUMNS
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.parameters import Array
from elbow_gym.simulation.writable import take_over
from elbow_gym.simulator import Simulator
from elbow_gym.task.actuation import Actuation
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.draws import Draws
from elbow_gym.task.infos import of_arm
from elbow_gym.task.observation import task_columns
from elbow_gym.task.reach import check_reachable
from elbow_gym.task.reward import Price, early_end
from elbow_gym.task.saved_state import check_basis, checked_rows, rows_of
from elbow_gym.task.sensing import Sensing, Snapshot, blank
from elbow_gym.task.settings import Settings
from elbow_gym.task.start import checked_state, drawn_poses, given_state
from elbow_gym.task.targets import Targets

RESET_OPTIONS = ("state", "phase", "circle", "parameters")
# The last figure is the reward itself.
*INFO_FIGURES, _ = FIGURES
REWARD = len(INFO_FIGURES)
ALL = slice(None)


class Outcome(NamedTuple):
    """Result of a control period, one entry per arm."""

    observation: NDArray[np.float32]
    reward: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    info: dict[str, Any]


class Episodes:
    """Simulator, targets, parameters and clocks of B arms under one `Settings`.

    Args:
        settings: the environment's arguments.
        num_envs: B, the number of arms.
        num_threads: threads over which blocks of arms are spread; the results do not depend on it.
        longest: control periods after which an episode is truncated at the latest; no limit but the duration when None.
    """

    def __init__(self, settings: Settings, num_envs: int = 1, num_threads: int = 1, longest: int | None = None) -> None:
        self.settings = settings
        self.arm = settings.parsed_arm
        self.circle = settings.parsed_circle
        """Path of the targets, or ranges from which each arm's is drawn at its reset."""
        self.simulator = Simulator(
            self.arm,
            settings.elbow_joints,
            num_envs,
            conditions=settings.conditions,
            timestep=float(settings.substeps.min()),
            integrator=settings.integrator,
            num_threads=num_threads,
            duration=settings.duration,
        )
        self.simulator.period = settings.control_period
        self.num_envs = num_envs
        weights = float(settings.tracking_weight), float(settings.energy_weight)
        self._price = np.array(Price(*weights, settings.control_frequency, settings.regeneration))
        self.pose = self.simulator.on_table(self.arm.nominal_pose)[0]
        """Start pose [rad], (n,): the nominal one, on the elbows' plane. Observed angles count from it."""
        self.population = Population(self.arm, settings.conditions, settings.randomization, num_envs)
        self.horizon = settings.horizon if longest is None else min(settings.horizon, longest)
        """Control periods after which an episode is truncated."""
        self._task = task_columns(num_envs, self.horizon if settings.task_observation else None)
        self.targets = Targets(self.circle, self._task, settings.control_period)
        self.actuation = Actuation(settings, self.population, self._task)
        self.sensing = Sensing(settings, self.simulator, self.population, self.actuation.queue)
        self.layout = self.sensing.layout
        self._draws = Draws(settings, self.population, self.targets)
        if settings.start == "on_target" and not self.circle.random:
            inverse_kinematics(self.arm, self.pose, self.circle.position(np.linspace(0.0, 2.0 * np.pi, 73)))
        # Arrays that every control period reads and resets bring up to date in place.
        layout, self._size = self.layout, self.layout.size
        self._asked = (self._task, self.targets.path, self.pose, layout.starts, np.stack([layout.scale, layout.high]))

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        take_over(self, self.settings, self.population, self.targets, self.actuation, self.sensing, self._draws)

    @property
    def highest_action(self) -> float:
        """Largest entry of an action, in the action's unit."""
        return 1.0 if self.settings.action_unit == "fraction" else float(self.settings.voltage_limit)

    @property
    def volts_per_action(self) -> float:
        """Terminal voltage per unit of action at the nominal supply voltage [V]."""
        return float(self.settings.voltage_limit) / self.highest_action

    @property
    def tracking_weight(self) -> float:
        """Cost per metre of tracking error [1/m], from the next step on."""
        return float(self._price[0])

    @tracking_weight.setter
    def tracking_weight(self, weight: float) -> None:
        self._price[0] = weight

    @property
    def energy_weight(self) -> float:
        """Cost per watt of electrical power [1/W], from the next step on."""
        return float(self._price[1])

    @energy_weight.setter
    def energy_weight(self, weight: float) -> None:
        self._price[1] = weight

    def target(self) -> Array:
        """Present position of each target [m], (B, 3)."""
        return self.targets.position(self.angle())

    def reset(
        self,
        generators: Sequence[np.random.Generator],
        mask: NDArray[np.bool_] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Starts new episodes in the arms of `mask` (all when None), each drawing from its own generator.

        Options: `state`, a dict of q [rad] and, if wanted, q_dot [rad/s], current [A] and temperature_rise [K]; `phase`
        [rad]; `circle`, a dict of `Circle` fields instead of the environment's; `parameters`, a dict of values instead
        of drawn ones. Raises ValueError naming the option, with everything as it was, the generators included.
        """
        options = {} if options is None else as_dict("options", options)
        unknown = sorted(set(options) - set(RESET_OPTIONS), key=str)
        if unknown:
            raise ValueError(f"options must have only the entries {list(RESET_OPTIONS)}, got {unknown[0]!r}")
        chosen = np.flatnonzero(np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask)
        state = given_state(options.get("state"))
        circle = self.settings.given_circle(options.get("circle"))
        drawing = [generators[int(i)] for i in chosen]
        before = self.population.copy(), self.simulator.parameters(chosen)
        undrawn = [generator.bit_generator.state for generator in drawing]
        try:
            self._draw_arms(drawing, chosen, options.get("parameters"))
            if state is not None:
                start = checked_state(self.simulator, state, mask)
                volts = self.population.values["supply_voltage"][chosen]
                self.settings.check_steps("state", self.simulator.parameters(chosen), volts, start)
            circles = self.targets.draw(circle, drawing, options.get("phase"))
            self.targets.check(circles)
            if state is None:
                state = {
                    "q": drawn_poses(
                        self.settings, self.simulator, self.population, self.pose, drawing, circles, chosen
                    )
                }
            self.simulator.reset(**state, mask=mask)
        except BaseException:
            self.population.values = before[0]
            self.simulator.set_parameters(chosen, before[1])
            for generator, state_before in zip(drawing, undrawn, strict=True):
                generator.bit_generator.state = state_before
            raise
        self.targets.put(chosen, circles)
        self._draws.starts[chosen] = self.simulator.q[chosen]
        self._draws.renew()
        self.actuation.reset(chosen)
        self.sensing.set_noise(chosen, drawing)
        self._task[chosen, PAID] = 0.0

    def _draw_arms(self, generators: Sequence[np.random.Generator], chosen: NDArray[np.int64], given: Any) -> None:
        if given is None and not self.population.randomization.ranges and not self.population.changed:
            return
        values = self.population.draw(generators, given)
        self.actuation.check(values)
        rows = self.population.put(chosen, values)
        if given is not None and "length" in given:
            for arm in self.population.arms(chosen):
                check_reachable(arm, self.settings.elbow_joints, self.circle)
        self.simulator.set_parameters(chosen, rows)
        if given is not None:
            self.settings.check_steps("parameters", rows, values["supply_voltage"])

    def step(self, action: Array, waiting: NDArray[np.bool_] | None = None, arm: int | slice = ALL) -> Outcome:
        """One control period under `action`, held and clipped to the supply voltage; the outcome is that of `arm`.

        The action is in its unit, contiguous float64 (B, n). Arms that wait for their reset draw no noise.

        Raises ValueError, with the state untouched, when an action is not a number.
        """
        snapshot, voltage = blank(self.num_envs, self._size), np.empty(action.shape)
        invalid = self.simulator.control_step(
            (action, voltage, self.actuation.queue), self.settings.substeps, (*self._asked, self._price, *snapshot)
        )
        if invalid < 0:
            raise ValueError(f"action must not be NaN, got {action[np.isnan(action).any(axis=1)][0].tolist()}")
        self.sensing.complete(snapshot.observation, waiting)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        if invalid:
            terminated = ~self.simulator.valid
            self._charge_the_rest(terminated, snapshot, Price(*self._price.tolist()))
        terminated = terminated[arm]
        truncated = (self.simulator.periods[arm] >= self.horizon) & ~terminated
        reward = snapshot.figures[REWARD, arm]
        return Outcome(snapshot.observation[arm], reward, terminated, truncated, self.info(snapshot, voltage, arm))

    def _charge_the_rest(self, terminated: NDArray[np.bool_], snapshot: Snapshot, price: Price) -> None:
        """Charges terminated arms the worst reward for the remaining time, this control period included."""
        rest = np.maximum(self.settings.horizon - self.simulator.periods + 1, 1)[terminated]
        values = self.population.values
        motors = values["supply_voltage"][terminated], values["armature_resistance"][terminated]
        charge = early_end(self.layout, *motors, price, rest)
        snapshot.figure("reward_tracking")[terminated] = charge.tracking
        snapshot.figure("reward_energy")[terminated] = charge.energy
        snapshot.figure("reward")[terminated] = charge.total

    def angle(self) -> Array:
        """Present angle of each target on its path [rad], (B,)."""
        return self.targets.angle(self.simulator.periods)

    def observe(self, resting: NDArray[np.bool_] | None = None) -> Snapshot:
        """Observations of every arm now, between control periods: power and rewards are zero.

        Arms of the mask `resting` draw no noise, since they have not been reset.
        """
        price = self._price * (0.0, 0.0, 0.0, 1.0)
        snapshot = blank(self.num_envs, self._size)
        self.simulator.observe((*self._asked, price, *snapshot))
        self.sensing.complete(snapshot.observation, resting)
        return snapshot

    def info(self, snapshot: Snapshot, command: Array | None = None, arm: int | slice = ALL) -> dict[str, Any]:
        """Metrics of a control period and draws, of all arms or of one; after a reset without a command.

        New arrays with one row per arm, or the numbers and arrays of one arm.
        """
        if command is None:
            command = np.zeros((self.num_envs, self.arm.n_joints))
        summary = self.simulator.raw[1][arm].copy()
        info: dict[str, Any] = dict(zip(INFO_FIGURES, snapshot.figures[:, arm], strict=False))
        info["voltage"] = self.sensing.terminal_voltage(command)[arm]
        info["voltage_command"] = command[arm]
        info["elbow_force"], info["constraint_residual"] = summary[..., SUMMARY_COLUMNS:], summary.T[RESIDUAL]
        if not self.sensing.silent:
            rows = self.sensing.info()
            info.update(rows if isinstance(arm, slice) else of_arm(rows, arm))
        self._draws.tell(info, arm)
        return info

    def _own(self) -> dict[str, NDArray[Any]]:
        """Arrays of the running state by name, apart from the simulator's own; `steps` is a view of its clock."""
        kernels = {"steps": self.simulator.periods, "spent": self._task[:, PAID]}
        return {**kernels, "starts": self._draws.starts, "queue": self.actuation.queue, "noise": self.sensing.noise}

    def get_state(self, chosen: NDArray[np.int64] | None = None) -> dict[str, Any]:
        """A copy of everything that changes from step to step in the chosen arms (all when None), but the generators.

        `settings` are what the state rests on.
        """
        parts = {"targets": self.targets.get_state(), "parameters": self.population.values, **self._own()}
        running = {"simulator": self.simulator.get_state(), **parts}
        chosen = np.arange(self.num_envs) if chosen is None else chosen
        return {"settings": dict(self.settings.basis), **rows_of(running, chosen)}

    def checked(self, state: object, count: int) -> dict[str, Any]:
        """A saved state of `count` arms, for `put`. Raises ValueError naming what these episodes cannot go on from."""
        given = as_dict("state['episodes']", state)
        require_entries(given, ("settings", "simulator", "targets", "parameters"), "state['episodes']")
        check_basis(self.settings.basis, given["settings"])
        saved: dict[str, Any] = {**checked_rows(self._own(), given, count)}
        values = self.population.checked(given["parameters"], count)
        self.actuation.check(values)
        rows = self.population.rows(values)
        if self.population.differ(values):
            self.settings.check_steps("parameters", rows, values["supply_voltage"])
        saved["simulator"] = self.simulator.checked(given["simulator"], rows[:, PARAMETERS.index("length")])
        return {**saved, "parameters": values, "circles": self.targets.checked(given["targets"], count)}

    def put(
        self, chosen: NDArray[np.int64], saved: Mapping[str, Any], generators: Sequence[np.random.Generator]
    ) -> None:
        """Gives the chosen arms, (k,), what `checked` has passed, of k arms or of one for all, and their generators."""
        self.simulator.put(chosen, saved["simulator"])
        for name, array in self._own().items():
            array[chosen] = saved[name]
        circles = saved["circles"]
        self.targets.put(chosen, circles * len(chosen) if len(circles) == 1 else circles)
        rows = self.population.put(chosen, saved["parameters"])
        self.simulator.set_parameters(chosen, rows)
        self.actuation.take_values()
        self.sensing.set_noise(chosen, generators)
        self._draws.renew()
