"""Runge-Kutta step of a block: four evaluations and stages, then the pose back onto the elbows' plane."""

# pyright: basic

from elbow_gym.kernel.acceleration import accelerate
from elbow_gym.kernel.decay import current_coefficients
from elbow_gym.kernel.elbows import elbow_forces
from elbow_gym.kernel.projection import project
from elbow_gym.kernel.rows import FREE_DRIFT
from elbow_gym.kernel.recursion import inward, outward
from elbow_gym.kernel.slots import (
    ASTRAY, BELOW, DRIFT, DRIVE, EXPONENTIAL, LANES, LOWEST_FREE, LOWEST_Z, RUBBING, STEP, STRIDE, U,
)  # fmt: skip
from elbow_gym.kernel.rk4_stages import rk4_first, rk4_fourth, rk4_second, rk4_third
from elbow_gym.kernel.exponential_stages import (
    exponential_first, exponential_fourth, exponential_second, exponential_third,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(flat=True)
def evaluate(ws, shared, n, elbows):
    """Positions, inertias, biases and elbow forces at a stage's state, from which the joint accelerations follow."""
    outward(ws, n)
    inward(ws, n)
    elbow_forces(ws, shared, n, elbows)


@template(flat=True)
def move(ws, shared, n, elbows, steps):
    """Takes a gathered block through steps of given lengths [s], to an evaluated state at their end.

    With k_1 the slope at the start, k_2 at half a step along k_1, k_3 at half a step along k_2 and k_4 at a step along
    k_3, the state moves by h/6 k_1 + h/3 k_2 + h/3 k_3 + h/6 k_4. Each stage adds its share of that sum, then sets the
    state of the next one.

    Reads: LOWEST_Z, BELOW, DRIFT, ASTRAY.
    Writes: BELOW, ASTRAY, STEP.
    """
    tip = U((n - 1) * STRIDE)
    if RUBBING:
        for k in range(LANES):
            shared[STEP + k] = steps[0] if steps.size > 0 else 0.0
    evaluate(ws, shared, n, elbows)
    known = 0.0
    for s in range(steps.size):
        step = steps[s]
        # Warm windings have another resistance at every step.
        if EXPONENTIAL and (DRIVE or step != known):
            current_coefficients(ws, n, step)
            known = step
        for k in range(LANES):
            shared[BELOW + k] += step if ws[tip + LOWEST_Z + k] < -LOWEST_FREE else 0.0
        for number in range(1, 5):
            accelerate(ws, n, step / 3.0 if 1 < number < 4 else step / 6.0)
            take_stage(ws, n, step, number)
            if number == 4:
                project(ws, shared, elbows)
                for k in range(LANES):
                    left = shared[DRIFT + k] / step
                    shared[ASTRAY + k] = max(shared[ASTRAY + k], left if left > FREE_DRIFT else 0.0)
                    if RUBBING:
                        shared[STEP + k] = steps[min(s + 1, steps.size - 1)]
            # After stage 4 this is the summary of the end of the step, and k_1 of the next.
            evaluate(ws, shared, n, elbows)


@template(flat=True)
def take_stage(ws, n, step, number):
    """Stage `number`, 1 to 4, of a step by the method that the kernel is made for."""
    if EXPONENTIAL:
        if number == 1:
            exponential_first(ws, n, step)
        elif number == 2:
            exponential_second(ws, n, step)
        elif number == 3:
            exponential_third(ws, n, step)
        else:
            exponential_fourth(ws, n, step)
    elif number == 1:
        rk4_first(ws, n, step)
    elif number == 2:
        rk4_second(ws, n, step)
    elif number == 3:
        rk4_third(ws, n, step)
    else:
        rk4_fourth(ws, n, step)
