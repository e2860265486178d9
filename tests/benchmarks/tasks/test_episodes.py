"""Episodes on evaluation tasks are the environment's own, and a controller is told what it may know."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from agents.evaluation.player import player_of
from agents.evaluation.players import find_player
from agents.tasks import task_settings
from benchmarks.tasks.contenders import Contender, contenders
from benchmarks.tasks.episodes import DISTURBANCES, NOMINAL, UNITS, play, played, worst
from benchmarks.tasks.task_set import EVALUATION
from elbow_gym import ElbowArmEnv
from elbow_gym.suite import ENV

SHORT = {"duration": 2.1}
UNTOLD = DISTURBANCES["payload"]


def shortened(player):
    return replace(player, settings=replace(player.settings, **SHORT))


class Still:
    """Controller without voltage that keeps what it is given."""

    def __init__(self, _env):
        self.given = []

    def predict(self, observation, **_):
        self.given.append(observation.copy())
        return np.zeros((1, 10), np.float32), None


def still(elbows=2):
    """A player in the tasks' environment, and the controllers that it makes."""
    made = []

    def make(env):
        made.append(Still(env))
        return made[-1]

    return player_of("still", task_settings(ENV, elbows, SHORT), make), made


def test_a_policy_of_one_circle_plays_the_task_as_its_environment_does_after_a_reset_with_the_options():
    player, task = shortened(find_player("ppo", 2)), EVALUATION.numbered(2)[3]
    env = ElbowArmEnv(**player.settings.arguments)
    observation, _ = env.reset(seed=0, options=task)
    policy, rewards, over = player.make(env), [], False
    while not over:
        observation, reward, _, over, info = env.step(policy.predict(observation[None])[0][0])
        rewards.append(reward)
    found = play(player, 3, task, DISTURBANCES[NOMINAL])
    assert found["cost"] == pytest.approx(-sum(rewards), rel=1e-6)
    assert found["energy"] == pytest.approx(info["electrical_energy"], rel=1e-6)
    assert found["complete"] == 1.0


def test_payload_is_observed_unless_nobody_is_told():
    task = EVALUATION.numbered(2)[3]
    layout = gym.make(ENV).unwrapped.episodes.layout
    for disturbance, expected in ((DISTURBANCES[NOMINAL], task["parameters"]["payload"]), (UNTOLD, 0.0)):
        player, made = still()
        play(player, 3, task, disturbance)
        observed = layout.decode(np.concatenate(made[0].given))
        np.testing.assert_allclose(observed["payload"], expected, rtol=1e-6)
        np.testing.assert_allclose(observed["circle_radius"], task["circle"]["radius"], rtol=1e-6)


def test_a_controller_knows_nothing_of_what_disturbs_it():
    task, sizes = EVALUATION.numbered(2)[3], set()
    runs = {}
    for name in (NOMINAL, "delay", "noise", "constants"):
        player, made = still()
        figures = play(player, 3, task, DISTURBANCES[name])
        sizes |= {one.shape for one in made[0].given}
        runs[name] = np.concatenate(made[0].given), figures["cost"]
    assert sizes == {(1, gym.make(ENV).observation_space.shape[0])}
    # Without voltage a delay changes nothing; noise is in the observations alone, other constants move the arm.
    np.testing.assert_array_equal(runs["delay"][0], runs[NOMINAL][0])
    assert 1e-4 < np.abs(runs["noise"][0] - runs[NOMINAL][0]).mean() < 1e-2
    assert runs["noise"][1] == runs[NOMINAL][1] != runs["constants"][1]


def test_who_refuses_a_task_has_the_worst_episode():
    def refuse(_):
        raise ValueError("position must be within reach")

    settings = task_settings("ElbowArm-v0", 0)
    found = play(player_of("nobody", settings, refuse), 0, EVALUATION.numbered(0)[0], DISTURBANCES[NOMINAL])
    assert found == worst(settings)
    assert found["complete"] == 0.0
    # The cost is that of the error and the energy, by the reward's prices.
    expected = 250 * found["error_rms"] / 1e3 + 0.001 * found["energy"] / 0.02
    assert found["cost"] == pytest.approx(expected, rel=1e-9)
    assert found["cost"] > 1e4


def test_what_was_played_is_not_played_again_unless_another_player_may_have_its_name(tmp_path):
    entry = contenders([2])[3]
    tasks, told = {3: EVALUATION.numbered(2)[3]}, []
    first = played(entry, tasks, NOMINAL, tmp_path, told.append)
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert played(entry, tasks, NOMINAL, tmp_path, told.append) == first
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == kept
    assert list(first[3]) == list(UNITS)
    assert told == [1, 1]


def test_everybody_plays_with_all_training_seeds_and_policies_where_their_elbows_are():
    found = contenders([2, 1])
    assert [one.name for one in found if one.elbows == 1][:3] == ["pd", "computed_torque", "computed_torque_posture"]
    assert not any(one.slow for one in found)
    slow = [one.name for one in contenders([1], planners=True) if one.slow]
    assert slow == ["receding_horizon_payload", "sampling_mpc_payload"]
    # Whoever names one wants all that it is asked for.
    assert not contenders([1], ["sampling_mpc_payload"])[-1].slow
    for name in ("ppo", "sac", "clone"):
        assert [one.seed for one in found if (one.name, one.elbows) == (name, 2)] == [0, 1, 2, 3, 4]
    path = "elbow_gym/baselines/policies/ppo_elbows1_seed3"
    (guest,) = contenders([2, 1], [f"mine={path}"])[len(found) :]
    assert (guest.name, guest.elbows, guest.player().name) == ("mine", 1, "mine")
    with pytest.raises(ValueError, match="elbows must be 1 as in the policy's training, got 2"):
        contenders([2], [path])
    with pytest.raises(ValueError, match=r"player must be one of .*, got 'nobody'"):
        Contender("nobody", 2, what="nobody").player()
