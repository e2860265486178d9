"""Gymnasium environment of one arm: the batch of arms with a single one."""

from __future__ import annotations

import copy
import numbers
from collections.abc import Mapping
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from elbow_gym.checks import as_numbers
from elbow_gym.parameters import ArmParameters
from elbow_gym.rendering.screen import can_draw
from elbow_gym.rendering.viewer import RENDER_MODES, Viewer
from elbow_gym.task.attributes import TaskAttributes, check_arguments
from elbow_gym.task.episodes import Episodes
from elbow_gym.task.saved_state import checked_marks, number_of_arms
from elbow_gym.task.settings import Settings


def action_space(episodes: Episodes) -> spaces.Space[NDArray[np.float32]]:
    """Action space of one arm: `Box` (n,), float32."""
    high = np.float32(episodes.highest_action)
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(-high, high, (episodes.arm.n_joints,), np.float32))


def observation_space(episodes: Episodes) -> spaces.Space[NDArray[np.float32]]:
    """Observation space of one arm: `Box` (size,), float32."""
    high = episodes.layout.high
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(-high, high, dtype=np.float32))


class ElbowArmEnv(  # pyright: ignore[reportIncompatibleVariableOverride]
    TaskAttributes, gym.Env[NDArray[np.float32], NDArray[np.float32]]
):
    """A ten-joint arm with DC motors leans its elbows on a table and draws a circle; every joule is counted.

    ## Description

    The arm of the multi-point-elbow paper: joint 1 yaws, joints 2 to 10 pitch in the vertical plane that the yaw
    selects, each driven by a DC servo motor through a gear. Up to several *elbows* (joints held at z = 0 by the
    table) carry the arm's weight. The hand has to follow a circle; the cost is electrical energy.

    ## Action Space

    A `Box(-1, 1, (n,), float32)`: each motor's terminal voltage as a fraction of the supply voltage, held for one
    control period. With `action_unit="volt"` it is `Box(-V, V, (n,), float32)` in volts. Values outside act like
    the nearest bound.

    | Num | Action | Min | Max | Joint | Quantity (unit) |
    |-----|--------|-----|-----|-------|-----------------|
    | 0 | voltage of motor 1 over the supply voltage | -1 | 1 | 1 (yaw) | voltage (V) |
    | 1..n-1 | voltage of motors 2..n over the supply voltage | -1 | 1 | 2..n (pitch) | voltage (V) |

    ## Observation Space

    A flat `Box` of float32. Each entry is a quantity over its scale, saturated at its limit; `observation_names`
    lists the entries, `decode` turns them back into SI units.

    | Name | Entries | Unit | Scale | Limit | Meaning |
    |------|---------|------|-------|-------|---------|
    | joint_angle | n | rad | 0.3 | 10 | joint angle minus the start pose's |
    | joint_velocity | n | rad/s | 2 | 100 | joint velocity |
    | current | n | A | 5 | 500 | armature current |
    | hand_error | 3 | m | 0.5 | 10 | hand minus target, along x, y, z |
    | hand_position | 3 | m | 0.5 | 10 | hand minus the circle's centre, along x, y, z |
    | lookahead_error | 3 | m | 0.5 | 10 | hand minus the target 0.1 s later, along x, y, z |
    | target_angle | 2 | - | 1 | 1 | cosine and sine of the target's angle on the circle |
    | contact_force | n-1, with a table | N | 5 | 10000 | the table's normal force, joints 3 to n and the hand |
    | temperature_rise | n, with heat | K | 50 | 10000 | temperature of the windings above the ambient |
    | pending_voltage | n per period of the longest delay | V | 24 | 10000 | voltages still on their way, newest first |
    | further_error | 9, with the task | m | 0.5 | 10 | hand minus the target 0.3, 0.6 and 1.2 s later, along x, y, z |
    | target_velocity | 3, with the task | m/s | 0.2 | 100 | velocity of the target, along x, y, z |
    | circle_radius | 1, with the task | m | 0.1 | 10 | radius of the circle |
    | angular_velocity | 1, with the task | rad/s | 1 | 1000 | rate of the target's angle, negative if clockwise |
    | plane_normal | 3, with the task | - | 1 | 1 | normal of the circle's plane, about which the angle grows |
    | payload | 1, with the task | kg | 0.1 | 100 | mass at the hand |
    | time_left | 1, with the task | - | 1 | 1 | share of the episode that is left |

    ## Rewards

    `-(tracking_weight * |hand - target| + energy_weight * P)` per control period: the distance [m] at its end
    and the mean electrical power P [W] over it, so that by default one watt costs as much as one millimetre.
    The two terms are in `info` as `reward_tracking` and `reward_energy`.

    ## Starting State

    The paper's start pose (or, with `start="on_target"`, the pose with the hand on the circle) at rest without
    current, plus normal noise of `start_noise` rad per joint, projected onto the elbows' plane. `start_spread` draws
    poses within so many rad of the paper's in every joint, with every joint and the hand at z >= 0.
    `reset(options={"state": {"q": ..., "q_dot": ..., "current": ...}, "phase": ...})` sets it exactly; the options
    `circle` and `parameters` (dicts) replace what would be drawn.

    ## Episode End

    Truncated after `duration` seconds. Terminated only when the state leaves what float64 can represent, or when no
    finer steps keep account of the energy that a reset's state brought; the remaining time is then charged at the
    worst rate that the spaces' bounds allow.

    ## Arguments

    | Argument | Default | Meaning |
    |----------|---------|---------|
    | elbows | 2 | 0, 1, 2 as in the paper (joints (), (4,), (4, 7)), or a tuple of joint numbers |
    | arm | "paper" | preset name, path of a JSON file, an `ArmParameters`, or its JSON dict |
    | control_frequency | 50.0 | control periods, each with one action, per second [Hz] |
    | timestep | None | longest step of the integrator [s], refused where it is too long; None: chosen for accuracy |
    | integrator | "exponential" | Runge-Kutta of order 4 with exact decay of the currents, or "rk4" for the classical |
    | duration | 5.0 | episode length [s] |
    | voltage_limit | 24.0 | supply voltage of every motor [V] |
    | action_unit | "fraction" | "fraction" of the supply voltage, or "volt" |
    | start | "paper" | "paper" or "on_target" |
    | start_noise | 0.02 | standard deviation of the start pose [rad] |
    | start_spread | 0.0 | largest difference of a joint from the paper's pose [rad], drawn with all joints at z >= 0 |
    | circle | None | dict of center, radius, period, plane, tilt, phase, shape...; ranges or "random" are drawn |
    | tracking_weight | 1.0 | cost per metre of tracking error |
    | energy_weight | 0.001 | cost per watt of electrical power |
    | regeneration | True | whether negative electrical power is credited, and taken back by the supply |
    | table | False | a compliant table that cannot pull: True, or a dict of stiffness, dissipation, friction... |
    | elbow_friction | 0.0 | Coulomb's coefficient of rigid elbows, where they push; at most 1 |
    | gear_coulomb_friction | None | Coulomb friction of every gear at the motor shaft [N m] |
    | heat | False | whether windings warm up and their resistance grows |
    | supply_resistance | 0.0 | resistance inside the motors' common supply [ohm] |
    | payload | 0.0 | mass at the hand [kg] |
    | randomize | None | dict of ranges drawn anew at each reset, see `elbow_gym.task.randomization`, or "tasks" |
    | task_observation | False | whether the observation says what the task is |

    `render_mode` ("rgb_array" or "human", None by default), `render_width` (640) and `render_height` (480) choose the
    picture.

    `info` holds tracking_error [m], electrical_power [W], electrical_energy, drawn_energy and link_work [J] since the
    reset, reward_tracking, reward_energy, voltage [V] at the motors' terminals at the period's end, voltage_command
    [V], which a sagging supply falls short of, elbow_force [N], constraint_residual [m/s^2], the vertical acceleration
    that an elbow has in spite of its force, and below_table [s].

    A table adds contact_force [N] (joints 3 to n and the hand; radial, tangential, normal), load_bearing and
    contact_loss [J]; heat adds temperature_rise [K] and overheated; a supply's resistance adds supply_loss [J].
    Where they are drawn, `parameters` and `circle` have the arm's and the circle's, and `start` the start pose q; a
    reset with `elbow_gym.reset_options(info)` sets them again. All keys are there after a reset and after a step.

    `energy_weight` and `tracking_weight` can be set on `env.unwrapped`, from the next step on; the other arguments can
    be read there. `env.spec.max_episode_steps` is the number of control periods in an episode.

    ## Version History

    * v0: first version. Until the release of 0.1.0 its figures may move, as they did with the exponential steps and
      starts on the table; the changelog says how. From then on whatever moves an episode's figures is a new version.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES) if can_draw() else [], "render_fps": 50}

    def __init__(
        self,
        *,
        elbows: int | tuple[int, ...] = 2,
        arm: str | ArmParameters | Mapping[str, Any] = "paper",
        render_mode: str | None = None,
        render_width: int = 640,
        render_height: int = 480,
        **settings: Any,
    ) -> None:
        check_arguments(settings, ElbowArmEnv.__init__)
        self.render_mode = render_mode
        self._episodes = Episodes(Settings(elbows=elbows, arm=arm, **settings))
        self.metadata = {**self.metadata, "render_fps": round(self.settings.control_frequency)}
        self.action_space = action_space(self._episodes)
        self.observation_space = observation_space(self._episodes)
        self._viewer = Viewer(self._episodes, render_mode, render_width, render_height)
        self._ready = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts an episode. Raises ValueError naming a wrong option, with everything as it was before."""
        before = self._np_random, self._np_random_seed
        # NumPy's integers are no ints, which Gymnasium asks for.
        super().reset(seed=int(seed) if isinstance(seed, numbers.Integral) else seed)
        try:
            self._episodes.reset([self.np_random], options=options)
        except BaseException:
            self._np_random, self._np_random_seed = before
            raise
        self._ready = True
        self._viewer.restart()
        snapshot = self._episodes.observe()
        return snapshot.observation[0], self._episodes.info(snapshot, arm=0)

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One control period. Raises ValueError, with the state untouched, on a wrong shape or NaN."""
        if not self._ready:
            raise gym.error.ResetNeeded("reset must be called before step")
        array = as_numbers("action", action, (self._episodes.arm.n_joints,))
        outcome = self._episodes.step(array[None], arm=0)
        self._viewer.follow()
        return (
            outcome.observation,
            float(outcome.reward),
            bool(outcome.terminated),
            bool(outcome.truncated),
            outcome.info,
        )

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """A fresh picture (height, width, 3) in the mode "rgb_array"; None in "human", where steps show it in a window.

        Needs pygame-ce, which `pip install "elbow-gym[render]"` brings; "rgb_array" needs no display. Changes neither
        the arm nor its random numbers.
        """
        pictures = self._viewer.render(self._ready)
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        """Closes the window, if there is one. May be called twice."""
        self._viewer.close()

    def get_state(self) -> dict[str, Any]:
        """Everything that changes from step to step, the random generator included, as of a batch of one arm."""
        return {
            "episodes": self._episodes.get_state(),
            "generators": [copy.deepcopy(self.np_random.bit_generator.state)],
            "over": np.zeros(1, dtype=np.bool_),
            "started": np.array([self._ready]),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restores a state of `get_state`, or of one arm of a batch; the run goes on bit for bit.

        The settings must be those that the state was made with, but for weights, start, circle, duration and ranges.
        Raises ValueError naming what is wrong with a state, with everything as it was.
        """
        count = number_of_arms(state)
        if count != 1:
            raise ValueError(f"state must be of one arm, got one of {count}")
        saved = self._episodes.checked(state["episodes"], 1)
        marks = checked_marks(state, [self.np_random])
        self._episodes.put(np.arange(1), saved, [self.np_random])
        self.np_random.bit_generator.state = marks.generators[0]
        self._ready = bool(marks.started[0])
        self._viewer.restart()
