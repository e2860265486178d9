"""Batch of arms in time, the only place where public (B, n) arrays meet the compiled kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym.checks import as_batch, positive, positive_integer
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.rows import (
    LARGEST_ANGLE,
    MAXIMUM_ELBOWS,
    PERIODS,
    STATE_ROWS,
    SUMMARY_COLUMNS,
    SWITCHED_STATE,
    SWITCHED_STATE_ROWS,
    TIMESTEPS,
    VALID,
)
from elbow_gym.kernel.slots import BLOCK_LANES
from elbow_gym.kinematics import elbow_heights
from elbow_gym.parameters import ArmParameters, Array, as_arm, as_elbows
from elbow_gym.simulation.options import Conditions, as_conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.simulation.rates import rates
from elbow_gym.simulation.retaking import Retaking
from elbow_gym.simulation.state_checks import PLANE_TOLERANCE, check_angles, check_on_table, checked_arrays
from elbow_gym.simulation.step_limit import INTEGRATORS, check_timestep
from elbow_gym.simulation.thread_pool import Sharing
from elbow_gym.simulation.writable import take_over


class Simulator(Retaking):
    """B arms side by side under piecewise constant voltages, with the energies integrated alongside.

    Args:
        arm: an ArmParameters or a preset name.
        elbows: 0, 1, 2 as in the paper, or joint numbers held at z = 0.
        num_envs: B, the number of arms.
        conditions: payload, compliant table, friction, heat and supply; `Conditions()`, the paper's, when None.
        timestep: length of the steps that `step` takes [s]; refused where it is too long for the arm's fastest rate.
        integrator: "exponential": Runge-Kutta of order 4 with exact decay of the currents; "rk4": the classical method.
        num_threads: threads over which blocks of arms are spread; the results do not depend on it.
        duration: longest time between two resets [s], for which a step must resolve windings that warm up.

    Raises ValueError naming the argument.
    """

    def __init__(
        self,
        arm: ArmParameters | str | Mapping[str, Any] = "paper",
        elbows: int | tuple[int, ...] = 2,
        num_envs: int = 1,
        *,
        conditions: Conditions | None = None,
        timestep: float = 0.002,
        integrator: str = "exponential",
        num_threads: int = 1,
        duration: float = math.inf,
    ) -> None:
        self.arm = as_arm(arm)
        self.elbows = as_elbows(elbows, self.arm.n_joints)
        if len(self.elbows) > MAXIMUM_ELBOWS:
            raise ValueError(f"elbows must be at most {MAXIMUM_ELBOWS}, got {len(self.elbows)}")
        self.num_envs = positive_integer("num_envs", num_envs)
        self._num_threads = positive_integer("num_threads", num_threads)
        self.conditions = as_conditions(conditions)
        self.timestep = positive("timestep", timestep)
        if integrator not in INTEGRATORS:
            raise ValueError(f"integrator must be one of {INTEGRATORS}, got {integrator!r}")
        row = parameter_table(self.arm, self.conditions)
        found = rates(row, self.conditions, elbows=bool(self.elbows), duration=duration)
        check_timestep(self.timestep, self.timestep, found, integrator)
        self._switches = {
            "table": self.conditions.surface is not None,
            "rubbing": self.conditions.elbow_friction > 0.0 and bool(self.elbows),
            "drive": self.conditions.drive(self.arm),
            "exponential": integrator == "exponential",
        }
        n = self.arm.n_joints
        self._elbow_index = np.array(self.elbows, dtype=np.int64)
        switched = any(self._switches[name] for name in ("table", "rubbing", "drive"))
        rows = SWITCHED_STATE_ROWS if switched else STATE_ROWS
        self._state = np.zeros((self.num_envs, rows, n))
        self._summary = np.zeros((self.num_envs, SUMMARY_COLUMNS + len(self.elbows)))
        self._parameters = np.repeat(row[None], self.num_envs, axis=0)
        # Timesteps of `step` and control periods since the reset.
        self._clock = np.zeros((self.num_envs, 2), dtype=np.int64)
        self.period = 0.0
        """Length of a control period [s], by which `control_step` moves the clock."""
        self._motion = np.zeros(self.num_envs)
        self._attach()
        self._nominal = as_batch("nominal_pose", self.arm.nominal_pose, (self.num_envs, n))
        check_angles("nominal_pose", self._nominal)
        if self.elbows and np.abs(elbow_heights(self.arm, self.arm.nominal_pose, self.elbows)).max() > PLANE_TOLERANCE:
            self._nominal = self.on_table(self.arm.nominal_pose)
        self.reset()

    def _attach(self) -> None:
        # Up to two arms the lanes of a block would mostly idle.
        lanes = 1 if self.num_envs <= 2 else BLOCK_LANES
        self._kernel = kernel(lanes, **self._switches)
        self._sharing = Sharing(self.num_envs, lanes, self._num_threads)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the compiled functions and the threads, for pickling and copying."""
        return {name: value for name, value in self.__dict__.items() if name not in ("_kernel", "_sharing")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        take_over(self)
        self._attach()

    def reset(
        self,
        q: ArrayLike | None = None,
        q_dot: ArrayLike | None = None,
        current: ArrayLike | None = None,
        mask: NDArray[np.bool_] | None = None,
        temperature_rise: ArrayLike | None = None,
    ) -> None:
        """Sets state and zeroes clocks and meters of all arms, or of those in `mask` (B,).

        Args:
            q: relative angles [rad], (B, n) or (n,), elbows at z = 0 to 1e-8 m (`on_table` helps);
                the arm's nominal pose, moved onto the plane if it is not there, when None.
            q_dot: rates [rad/s] that keep the elbows on the table to 1e-6 m/s; zero when None.
            current: armature currents [A]; zero when None.
            mask: which arms, shape (B,); all when None.
            temperature_rise: temperature of the windings above the ambient [K]; zero when None.
        """
        *given, chosen = self.check_state(q, q_dot, current, mask, temperature_rise)
        # They may be views of the running state, which is zeroed next.
        q, q_dot, current, rise = (quantity.copy() for quantity in given)
        self._state[chosen] = 0.0
        if self.conditions.heat:
            self._state[chosen, STATE_ROWS + SWITCHED_STATE.index("temperature_rise")] = rise[chosen]
        self._state[chosen, 0] = q[chosen]
        self._state[chosen, 1] = q_dot[chosen]
        self._state[chosen, 2] = current[chosen]
        valid = self._summary[:, VALID].copy()
        self._summary[chosen] = 0.0
        self._clock[chosen] = 0
        self._watch(chosen)
        self.advance(np.zeros((self.num_envs, self.arm.n_joints)), np.zeros(0))
        # A new summary of the other arms' last state does not make it the outcome of their last step.
        self._summary[~chosen, VALID] = valid[~chosen]

    def parameters(self, chosen: NDArray[np.int64]) -> Array:
        """A copy of the kernel's parameter rows of some arms, (k, PARAMETER_ROWS, n)."""
        return self._parameters[chosen]

    def set_parameters(self, chosen: NDArray[np.int64], rows: Array) -> None:
        """Gives some arms other parameter rows, as `parameter_rows` makes them, from now on."""
        self._parameters[chosen] = rows

    def on_table(self, q: ArrayLike) -> Array:
        """The nearest poses (least change of absolute pitch) with every elbow at z = 0 [rad], (B, n).

        Raises ValueError when there is no such pose near one of `q`, (B, n) or (n,).
        """
        settled = as_batch("q", q, (self.num_envs, self.arm.n_joints)).copy()
        if self.elbows:
            self._kernel.project_poses(settled, self._parameters, self._elbow_index)
            if not (np.abs(settled).max() < LARGEST_ANGLE):
                raise ValueError(f"q must be near a pose with the elbows {self.elbows} at z = 0, got {q!r}")
            check_on_table(self.elbows, settled, np.zeros_like(settled), self._parameters[:, 0])
        return settled

    def check_state(
        self,
        q: ArrayLike | None = None,
        q_dot: ArrayLike | None = None,
        current: ArrayLike | None = None,
        mask: NDArray[np.bool_] | None = None,
        temperature_rise: ArrayLike | None = None,
    ) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
        """The arguments of `reset` as full arrays. Raises its ValueErrors and changes nothing."""
        n = self.arm.n_joints
        shape = (self.num_envs, n)
        q = self._nominal if q is None else as_batch("q", q, shape)
        q_dot = as_batch("q_dot", np.zeros(n) if q_dot is None else q_dot, shape)
        current = as_batch("current", np.zeros(n) if current is None else current, shape)
        rise = as_batch("temperature_rise", np.zeros(n) if temperature_rise is None else temperature_rise, shape)
        if rise.any() and not self.conditions.heat:
            raise ValueError(f"temperature_rise must be zero unless heat is True, got {np.abs(rise).max():g} K")
        chosen = np.ones(self.num_envs, dtype=np.bool_) if mask is None else np.asarray(mask, dtype=np.bool_)
        if chosen.shape != (self.num_envs,):
            raise ValueError(f"mask must have shape {(self.num_envs,)}, got {chosen.shape}")
        check_angles("q", q)
        if self.elbows:
            check_on_table(self.elbows, q[chosen], q_dot[chosen], self._parameters[chosen, 0])
        return q, q_dot, current, rise, chosen

    def step(self, voltage: ArrayLike, n_substeps: int = 1) -> None:
        """Advances every arm by n_substeps timesteps under constant terminal voltages [V], (B, n) or (n,).

        An arm whose state leaves what float64 can represent keeps its last state and shows in `valid`.
        Raises ValueError, with the state untouched, on a wrong shape, a non-finite voltage or n_substeps < 1.
        """
        voltage = as_batch("voltage", voltage, (self.num_envs, self.arm.n_joints))
        count = positive_integer("n_substeps", n_substeps)
        self.advance(np.array(voltage, order="C"), np.full(count, self.timestep))
        self._clock[:, TIMESTEPS] += count

    def advance(self, voltage: Array, steps: Array) -> None:
        """Advances every arm through steps of given lengths [s] under constant voltages, without checks or clock.

        For callers that made the checks of `step`: a contiguous float64 (B, n) of finite volts.
        """
        own = (self._state, self._parameters, voltage, self._elbow_index, steps, self._summary)
        self._sharing.total(self._kernel.advance, *own)

    def control_step(self, actions: tuple[Array, ...], steps: Array, task: tuple[NDArray[Any], ...]) -> int:
        """One control period of every arm, from actions to observations and rewards.

        Args:
            actions: the arguments of the kernel's `control_step` before the state.
            steps: lengths of the steps [s].
            task: its arguments behind the clock.

        Returns:
            The number of arms that are not `valid`, in finer steps neither; a negative one, with nothing changed, where
            an action is NaN.
        """
        # One share checks its own actions before it moves; several must not move before all are checked.
        if self._num_threads > 1 and np.isnan(actions[0]).any():
            return -1
        kept = self._kept(task[0]) if self._restless else None
        own = (self._state, self._parameters, self._elbow_index, steps, self._summary, self._clock)
        invalid = self._sharing.total(self._kernel.control_step, *actions, *own, *task)
        if invalid < 0 or (invalid == 0 and kept is None):
            return invalid
        return self._taken_again(actions[1], steps, task, kept)

    def observe(self, task: tuple[NDArray[Any], ...]) -> None:
        """Observations and figures of every arm as it is; `task` is that of `control_step`."""
        self._kernel.observe(*self.raw, *task, first=0, end=self.num_envs)

    @property
    def raw(self) -> tuple[Array, Array, NDArray[np.int64]]:
        """The kernel's own state, summary and clock arrays, for functions that only read them."""
        return self._state, self._summary, self._clock

    def close(self) -> None:
        """Ends the threads. May be called twice; what steps afterwards starts them again."""
        self._sharing.close()

    def get_state(self) -> dict[str, NDArray[Any]]:
        """A copy of the state, summary and clock; `set_state` continues from it bit for bit."""
        return {name: array.copy() for name, array in self._own().items()}

    def _own(self) -> dict[str, NDArray[Any]]:
        return {"state": self._state, "summary": self._summary, "clock": self._clock, "motion": self._motion}

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores a state of an equal simulator. Raises ValueError as `checked_arrays`, with nothing changed."""
        self.put(np.arange(self.num_envs), self.checked(state, self._parameters[:, 0]))

    def checked(self, state: object, length: Array) -> dict[str, NDArray[Any]]:
        """The arrays of a saved state of arms with the lengths [m], (k, n), by name. Raises as `set_state`."""
        return checked_arrays(self._own(), state, self.elbows, length)

    def put(self, chosen: NDArray[np.int64], saved: Mapping[str, NDArray[Any]]) -> None:
        """Gives the chosen arms, (k,), states that `checked` has passed, of k arms or of one for all."""
        for name, array in self._own().items():
            array[chosen] = saved[name]
        self._restless = bool(self._motion.any())

    @property
    def time(self) -> Array:
        """Time since the reset [s], (B,)."""
        return self._clock[:, TIMESTEPS] * self.timestep + self.periods * self.period

    @property
    def periods(self) -> NDArray[np.int64]:
        """Control periods since the reset, (B,)."""
        return self._clock[:, PERIODS]
