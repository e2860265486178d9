"""B episodes side by side: the one engine under the single and the batched environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym import kernel, task
from elbow_gym.circle import as_phase
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.parameters import Array
from elbow_gym.settings import Settings
from elbow_gym.simulator import Simulator

RESET_OPTIONS = ("state", "phase")
STATE_ENTRIES = ("q", "q_dot", "current")
# The last figure is the reward itself.
INFO_FIGURES = kernel.FIGURES[:-1]


class Outcome(NamedTuple):
    """What a control step gives, one entry per arm."""

    observation: NDArray[np.float32]
    reward: Array
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    info: dict[str, Array]


class Episodes:
    """Simulator, targets and clocks of B arms under one `Settings`.

    Args:
        settings: the environment's arguments.
        num_envs: B.
        num_threads: see `Simulator`.
    """

    def __init__(self, settings: Settings, num_envs: int = 1, num_threads: int = 1) -> None:
        self.settings = settings
        self.arm = settings.parsed_arm
        self.circle = settings.parsed_circle
        self.layout = task.ObservationLayout(self.arm.n_joints)
        self.simulator = Simulator(
            self.arm,
            settings.elbow_joints,
            num_envs,
            timestep=settings.control_period / settings.n_substeps,
            num_threads=num_threads,
        )
        self.num_envs = num_envs
        self.tracking_weight = float(settings.tracking_weight)
        self.energy_weight = float(settings.energy_weight)
        self.pose = self.simulator.on_table(self.arm.nominal_pose)[0]
        """Start pose [rad], (n,): the nominal one, on the elbows' plane. Observed angles count from it."""
        if settings.start == "on_target":
            self._on_target(np.linspace(0.0, 2.0 * np.pi, 73))
        self._path = np.repeat(self.circle.path[None], num_envs, axis=0)
        self._n_substeps, self._horizon = settings.n_substeps, settings.horizon
        self._turn = self.circle.rate * settings.control_period
        self._lookahead = np.full(num_envs, self.circle.rate * task.LOOKAHEAD)
        self._volts = 1.0 if settings.action_unit == "volt" else float(settings.voltage_limit)
        self._highest = float(settings.voltage_limit) / self._volts
        self._phase = np.zeros(num_envs)
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._spent = np.zeros(num_envs)

    @property
    def highest_action(self) -> float:
        """Largest entry of an action, in the action's unit."""
        return self._highest

    @property
    def volts_per_action(self) -> float:
        """Terminal voltage per unit of action [V]."""
        return self._volts

    def target(self) -> Array:
        """The targets' positions now [m], (B, 3)."""
        return self.circle.position(self.angle())

    def _on_target(self, angle: Array) -> Array:
        return inverse_kinematics(self.arm, self.pose, self.circle.position(angle))[0]

    def reset(
        self,
        generators: Sequence[np.random.Generator],
        mask: NDArray[np.bool_] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        """Starts new episodes in the arms of `mask` (all when None), each drawing from its own generator.

        Options: `state`, a dict of q [rad] and, if wanted, q_dot [rad/s] and current [A]; `phase` [rad].
        Raises ValueError naming the option, with everything as it was.
        """
        options = {} if options is None else options
        unknown = sorted(set(options) - set(RESET_OPTIONS))
        if unknown:
            raise ValueError(f"options must have only the entries {list(RESET_OPTIONS)}, got {unknown[0]!r}")
        chosen = np.flatnonzero(np.ones(self.num_envs, dtype=np.bool_) if mask is None else mask)
        drawing = [generators[int(i)] for i in chosen]
        state = self._given_state(options.get("state"))
        if state is not None:
            self.simulator.check_state(**state, mask=mask)
        phase = self._draw_phase(drawing, options.get("phase"))
        if state is None:
            state = {"q": self._draw_pose(drawing, phase, chosen)}
        self.simulator.reset(**state, mask=mask)
        self._phase[chosen] = phase
        self._steps[chosen] = 0
        self._spent[chosen] = 0.0

    def _draw_phase(self, generators: Sequence[np.random.Generator], given: object) -> Array:
        if given is not None:
            return np.full(len(generators), as_phase(given))
        if self.circle.phase == "random":
            return np.array([generator.uniform(-np.pi, np.pi) for generator in generators])
        return np.full(len(generators), float(self.circle.phase))

    def _draw_pose(self, generators: Sequence[np.random.Generator], phase: Array, chosen: NDArray[np.int64]) -> Array:
        noise = self.settings.start_noise
        q = np.tile(self.pose, (self.num_envs, 1))
        if self.settings.start == "on_target":
            q[chosen] = self._on_target(phase)
        if noise > 0.0:
            q[chosen] += noise * np.stack([generator.standard_normal(self.arm.n_joints) for generator in generators])
            q = self.simulator.on_table(q)
        return q

    @staticmethod
    def _given_state(state: object) -> dict[str, Any] | None:
        if state is None:
            return None
        if not isinstance(state, Mapping):
            raise ValueError(f"options['state'] must be a dict, got {state!r}")
        unknown = sorted(str(key) for key in set(state) - set(STATE_ENTRIES))  # pyright: ignore[reportUnknownVariableType,reportUnknownArgumentType]
        if unknown:
            raise ValueError(f"options['state'] must have only the entries {list(STATE_ENTRIES)}, got {unknown[0]!r}")
        if "q" not in state:
            raise ValueError(f"options['state'] must have the entry 'q', got {sorted(state)}")  # pyright: ignore
        return {str(key): state[key] for key in state}  # pyright: ignore

    def step(self, action: Array) -> Outcome:
        """One control period under `action`, held and clipped to the supply voltage.

        The action is in its unit, contiguous float64 (B, n).

        Raises ValueError, with the state untouched, when an action is not a number.
        """
        voltage = np.empty_like(action)
        if not kernel.drive(action, self._highest, self._volts, voltage):
            raise ValueError(f"action must not be NaN, got {action[np.isnan(action).any(axis=1)][0].tolist()}")
        self._steps += 1
        settings = self.settings
        price = task.Price(self.tracking_weight, self.energy_weight, settings.control_frequency, settings.regeneration)
        sight, look = self._looking(price)
        invalid = self.simulator.advance(voltage, self._n_substeps, look)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        truncated = self._steps >= self._horizon
        if invalid:
            terminated = ~self.simulator.valid
            self._charge_the_rest(terminated, sight)
            truncated &= ~terminated
        info = self.info(sight, voltage)
        return Outcome(sight.observation, sight.figure("reward"), terminated, truncated, info)

    def _charge_the_rest(self, terminated: NDArray[np.bool_], sight: task.Sight) -> None:
        """Ending early never pays: the remaining time costs the worst that the observation's bounds allow."""
        bound = self.layout.high * self.layout.scale
        worst_error = np.linalg.norm(bound[self.layout.slices["hand_error"]])
        worst_power = self.settings.voltage_limit * bound[self.layout.slices["current"]].sum()
        rest = np.maximum(self.settings.horizon - self._steps + 1, 1)[terminated]
        tracking, energy = -self.tracking_weight * worst_error * rest, -self.energy_weight * worst_power * rest
        for name, values in (
            ("reward_tracking", tracking),
            ("reward_energy", energy),
            ("reward", tracking + energy),
        ):
            sight.figure(name)[terminated] = values

    def angle(self) -> Array:
        """The target's angle on the circle now [rad], (B,)."""
        return self._phase + np.multiply(self._turn, self._steps, dtype=np.float64)

    def _looking(self, price: task.Price) -> tuple[task.Sight, Callable[[int, int], None]]:
        target = task.Target(self._path, self.angle(), self._lookahead)
        return task.looking(self.layout, self.simulator, self.pose, target, price, self._spent)

    def look(self) -> task.Sight:
        """What is seen of every arm now, between control steps: power and rewards are zero."""
        sight, look = self._looking(task.Price(0.0, 0.0, 0.0, self.settings.regeneration))
        look(0, self.num_envs)
        return sight

    def info(self, sight: task.Sight, voltage: Array | None = None) -> dict[str, Array]:
        """Fresh arrays of the step's figures, one row per arm; the voltage is zero when None, after a reset."""
        return {
            **dict(zip(INFO_FIGURES, sight.figures, strict=False)),
            "voltage": np.zeros((self.num_envs, self.arm.n_joints)) if voltage is None else voltage,
            "elbow_force": self.simulator.elbow_force.copy(),
        }

    def get_state(self) -> dict[str, Any]:
        """A copy of everything that runs on but the generators."""
        own = {"phase": self._phase, "steps": self._steps, "spent": self._spent}
        return {"simulator": self.simulator.get_state(), **{name: array.copy() for name, array in own.items()}}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Takes a state of `get_state` from episodes of the same settings and size."""
        own = {"phase": self._phase, "steps": self._steps, "spent": self._spent}
        for name in (*own, "simulator"):
            if name not in state:
                raise ValueError(f"state must have the entry {name!r}, got {sorted(state)}")
        for name, array in own.items():
            if np.shape(state[name]) != array.shape:
                raise ValueError(f"state[{name!r}] must have shape {array.shape}, got {np.shape(state[name])}")
        self.simulator.set_state(state["simulator"])
        self._phase, self._steps, self._spent = (np.array(state[name]) for name in own)
