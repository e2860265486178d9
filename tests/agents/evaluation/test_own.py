"""Players that a user brings: every kind plays, and what does not fit is refused by name."""

import json
import sys

import numpy as np
import pytest

from agents.evaluation.own import Adapted, labelled
from agents.evaluation.players import find_player
from agents.evaluation.regimes import in_all_regimes
from agents.shipped.seeds import load_policy
from agents.tasks import RUNS
from elbow_gym import Interface
from elbow_gym.baselines.policy import baseline_path, pair
from elbow_gym.vector_env import ElbowArmVectorEnv
from tests.support.arms import six_joint_arm

SHORT = {"duration": 2.1}
CONTROLLERS = """
import numpy as np
class Still:
    environment = {"control_frequency": 100.0, "duration": 2.1}
    def __init__(self, env):
        self.num_envs = env.num_envs
    def predict(self, observation):
        return np.zeros((self.num_envs, 10), dtype=np.float32)
class Both:
    class Inner:
        def predict(self, observation, state=None, deterministic=False):
            assert deterministic
            return np.zeros((len(observation), 10)), state
ready = Both.Inner()
def wrong(env):
    return 3
number = 3
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / "own_controllers.py").write_text(CONTROLLERS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    sys.modules.pop("own_controllers", None)
    return tmp_path


def played(player):
    return in_all_regimes(player, [1, 2])["A"]["electrical_energy"]


@pytest.mark.parametrize("name", ["own_controllers:Still", "own_controllers:ready", "own_controllers.py:Both.Inner"])
def test_python_objects_play_whatever_their_predict_takes_and_gives(here, name):
    if name.endswith("Inner"):
        with pytest.raises(TypeError):
            find_player(name, 0, arguments=SHORT).make(None)
        return
    player = find_player(f"mine={name}", 0, arguments=SHORT)
    assert (player.name, player.label, player.identity) == ("mine", "mine", "")
    assert player.settings.control_frequency == (100.0 if "Still" in name else 50.0)
    assert (played(player) < 1e-9).all()


def test_python_object_plays_without_an_import_path():
    class Idle:
        def predict(self, observation):
            return np.zeros((len(observation), 10))

    assert find_player(Idle(), 0, arguments=SHORT).label == "Idle"
    assert (played(find_player(lambda _: Idle(), 0, arguments=SHORT)) < 1e-9).all()


def test_folder_of_a_run_is_found_as_the_training_prints_it(here):
    source = baseline_path("ppo_elbows2")
    folder = here / RUNS / "ppo_elbows2_seed2"
    folder.mkdir(parents=True)
    for path in pair(source):
        (folder / f"best{path.suffix}").write_bytes(path.read_bytes())
    for name in ("runs/ppo_elbows2_seed2", "ppo_elbows2_seed2", str(folder), "runs/ppo_elbows2_seed2/best.json"):
        player = find_player(name)
        assert player.identity == load_policy(source).card.digest
        assert player.settings == load_policy(source).settings
    assert find_player("ppo_elbows2_seed2").label == "ppo_elbows2_seed2"
    assert find_player("runs/ppo_elbows2_seed2/best").label == "ppo_elbows2_seed2"
    with pytest.raises(ValueError, match=r"^elbows must be 2 as in the policy's training, got 1"):
        find_player("ppo_elbows2_seed2", 1)


def test_folder_without_a_policy_is_refused(here):
    (here / "empty").mkdir()
    with pytest.raises(ValueError, match=r"^the folder of a run must hold best.json, got empty"):
        find_player("empty")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("own_controllers:Nobody", "has no attribute 'Nobody'"),
        ("nowhere_at_all:Still", "No module named 'nowhere_at_all'"),
        ("own_controllers:number", r"own_controllers:number must have predict\(observation\) or make .* got 3"),
    ],
)
def test_what_cannot_play_is_refused_by_name(here, name, reason):
    with pytest.raises(ValueError, match=reason):
        find_player(name)


def test_maker_of_something_else_is_refused(here):
    env = ElbowArmVectorEnv(1)
    with pytest.raises(ValueError, match=r"^own_controllers:wrong must make an object with predict\(.* got 3"):
        find_player("own_controllers:wrong").make(env)


def test_unknown_name_lists_the_classical_controllers_too():
    with pytest.raises(ValueError, match=r"'pd_paper', 'pd', .*'computed_torque'.*module:callable, got 'sca'"):
        find_player("sca")


@pytest.mark.parametrize(
    ("word", "parts"),
    [("a=b", ("a", "b")), ("b", (None, "b")), ("=b", (None, "=b")), ("a=", (None, "a=")), ("a=b=c", ("a", "b=c"))],
)
def test_label_is_what_is_before_the_first_equals_sign(word, parts):
    assert labelled(word) == parts


def test_file_with_an_equals_sign_in_its_name_is_no_label(here):
    (here / "a=b.zip").touch()
    assert labelled("a=b.zip") == (None, "a=b.zip")


def test_zip_is_not_read_without_trust(here):
    (here / "model.zip").write_bytes(b"cos\nsystem\n")
    with pytest.raises(ValueError, match=r"^--trust must be given for model.zip, whose pickles can run any code"):
        find_player("model.zip")
    pytest.importorskip("stable_baselines3")
    player = find_player("model.zip", trust=True)
    with pytest.raises(ValueError, match=r"^model.zip must be a model that Stable-Baselines3 has saved, got: "):
        player.make(ElbowArmVectorEnv(1, **player.settings.arguments))


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_model_of_stable_baselines3_acts_as_it_does_there(here, algorithm):
    sb3 = pytest.importorskip("stable_baselines3")
    from elbow_gym.sb3 import SB3VecEnv

    env = SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode="SameStep"))
    model = getattr(sb3, algorithm)("MlpPolicy", env, seed=1, policy_kwargs={"net_arch": [8]})
    model.save("model")
    controller = find_player("model.zip", 2, trust=True).make(ElbowArmVectorEnv(2))
    observation = env.reset()
    np.testing.assert_array_equal(
        controller.predict(observation, deterministic=True)[0], model.predict(observation, deterministic=True)[0]
    )
    other = find_player("model.zip", 2, arguments={"action_unit": "volt"}, trust=True)
    with pytest.raises(ValueError, match=r"^action space of model.zip must be the environment's Box\(-24"):
        other.make(ElbowArmVectorEnv(1, **other.settings.arguments))
    heated = find_player("model.zip", 2, arguments={"heat": True}, trust=True)
    with pytest.raises(ValueError, match=r"the environment's Box of shape \(51,\), got Box of shape \(41,\)$"):
        heated.make(ElbowArmVectorEnv(1, **heated.settings.arguments))


@pytest.mark.slow
def test_classical_controllers_play_on_another_arm(here):
    (here / "mine.json").write_text(json.dumps(six_joint_arm().to_dict()))
    player = find_player("computed_torque", (4,), arguments={"arm": "mine.json", "start_noise": 0.0})
    assert player.settings.elbow_joints == (4,)
    assert in_all_regimes(player, [1])["B"]["error_rms"][0] < 1.0
    with pytest.raises(ValueError, match=r"^lqr must play its optimal trajectory in the default environment"):
        find_player("lqr", 2, arguments={"arm": "mine.json"})


def test_adapted_controller_reads_batches_through_an_interface():
    env = ElbowArmVectorEnv(3)
    interface = Interface(env)

    class Hold:
        def predict(self, observation):
            return interface.action(interface.decode(observation)["current"])

    observation, _ = env.reset(seed=0)
    action, state = Adapted(Hold()).predict(observation, deterministic=True)
    assert action.shape == (3, 10)
    assert state is None
