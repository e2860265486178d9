"""`python -m agents verify`: shipped policies and the PD's joules are checked, and what is altered is named."""

import json
import shutil
from functools import cache

import pytest

from agents import verification
from agents.__main__ import app
from agents.evaluation.receipt import player_again
from agents.evaluation.regimes import in_all_regimes
from agents.shipped import CURVES, RECEIPTS
from agents.verification import joules_again, shipped_policies
from elbow_gym.baselines.policy import BASELINES
from elbow_gym.verification import CHECKS

NAME = "ppo_elbows2_seed2"


@pytest.fixture
def copy(tmp_path):
    """Folders with a copy of one shipped policy, and of the learning curve of its training."""
    policies, curves = tmp_path / "policies", tmp_path / "curves"
    for folder, source, suffixes in ((policies, BASELINES, ("json", "safetensors")), (curves, CURVES, ("csv",))):
        folder.mkdir()
        for suffix in suffixes:
            shutil.copy(source / f"{NAME}.{suffix}", folder)
    return policies, curves


def bit_flipped(policies, _):
    path = policies / f"{NAME}.safetensors"
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def card_changed(policies, _):
    path = policies / f"{NAME}.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"activation": "relu"}))


def file_missing(policies, _):
    (policies / f"{NAME}.safetensors").unlink()


def policy_missing(policies, _):
    for path in policies.iterdir():
        path.unlink()


def curve_missing(_, curves):
    (curves / f"{NAME}.csv").unlink()


def renamed(policies, curves):
    for path in [*policies.iterdir(), *curves.iterdir()]:
        path.rename(path.with_name(path.name.replace("elbows2", "elbows1")))


def everything_missing(policies, curves):
    policy_missing(policies, curves)
    curve_missing(policies, curves)


def test_shipped_policies_are_verified_by_their_digests():
    assert shipped_policies() == f"{len(list(CURVES.glob('*.csv')))} by their digests"


@pytest.mark.parametrize(
    ("altered", "message"),
    [
        (bit_flipped, f"{NAME}: weights and card must be those of the digest "),
        (card_changed, f"{NAME}: weights and card must be those of the digest "),
        (file_missing, f"{NAME}: policy must be "),
        (policy_missing, f"{NAME}: policies and learning curves must be one and one, got 0 and 1"),
        (curve_missing, f"{NAME}: policies and learning curves must be one and one, got 1 and 0"),
        (renamed, r"ppo_elbows1_seed2: policies must be named ppo\[_LABEL\]_elbows2_seed2 as what they hold, got "),
        (everything_missing, "policies must be in "),
    ],
)
def test_altered_copy_of_a_policy_is_named(copy, altered, message):
    assert shipped_policies(copy[:1], copy[1]) == "1 by their digests"
    altered(*copy)
    with pytest.raises(ValueError, match=f"^{message}"):
        shipped_policies(copy[:1], copy[1])


def test_policy_that_is_there_twice_is_named(copy):
    with pytest.raises(ValueError, match=f"^{NAME}: policies and learning curves must be one and one, got 2 and 1$"):
        shipped_policies([copy[0], copy[0]], copy[1])


@pytest.mark.slow
def test_joules_of_the_pd_are_those_of_its_receipt_and_other_ones_are_named(tmp_path, monkeypatch):
    # Both receipts are of one player and seed.
    played = cache(lambda *_: in_all_regimes(player_again(given), given["seeds"]))
    monkeypatch.setattr("agents.evaluation.receipt.in_all_regimes", lambda *_: played())
    given = json.loads((RECEIPTS / "pd_elbows2.json").read_text()) | {"code": "another", "seeds": [20_000]}
    given["joules"] = {regime: values[:1] for regime, values in given["joules"].items()}
    path = tmp_path / "pd.json"
    path.write_text(json.dumps(given))
    assert joules_again(path).startswith("verified to ")
    given["joules"]["B"][0] *= 1.0 + 1e-5
    path.write_text(json.dumps(given))
    with pytest.raises(ValueError, match=r"^energies must be the receipt's to 1e-06, got 1e-05 with other code"):
        joules_again(path)


def test_failed_check_is_a_line_and_an_exit_code_and_the_others_go_on(capsys, monkeypatch, tmp_path):
    checks = {"PD, elbows 2": lambda: joules_again(tmp_path / "none.json"), "shipped policies": shipped_policies}
    monkeypatch.setattr(verification, "CHECKS", checks)
    with pytest.raises(SystemExit, match="1"):
        app.run(["verify"])
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("FAIL  PD, elbows 2: ValueError: receipt must be a line of `evaluate --receipt` or ")
    assert second.startswith("ok    shipped policies: ")


@pytest.mark.soak
def test_checkout_passes_every_check_with_a_line_each(capsys):
    app.run(["verify"])
    lines = capsys.readouterr().out.splitlines()
    names = [*CHECKS, "shipped policies", "PD, elbows 2", "PD, elbows 1", "PD, elbows 0"]
    assert [line.split(":")[0] for line in lines] == [f"ok    {name}" for name in names]
