"""Receipts: the same machine gives the same bits, others nearly the same joules, and what differs is said."""

import json

import pytest

from agents.evaluation import receipt as receipts
from agents.evaluation.command import evaluate_all, verify_receipt
from agents.evaluation.receipt import ENTRIES, player_again, read_receipt, verify
from agents.task_options import TaskOptions


@pytest.fixture(scope="module")
def line():
    with pytest.MonkeyPatch.context() as patch:
        said = []
        patch.setattr("builtins.print", lambda *words, **_: said.append(" ".join(words)))
        task = TaskOptions(elbows=1, environment={"duration": 2.1})
        evaluate_all(["ppo"], task, episodes=2, trust=False, receipts=True)
    return said[-1]


def test_receipt_has_settings_seeds_digest_and_joules_in_a_line(line):
    found = read_receipt(line)
    assert set(found) == set(ENTRIES)
    assert "\n" not in line
    assert found["seeds"] == [20_000, 20_001]
    assert {name: len(values) for name, values in found["joules"].items()} == {"A": 2, "B": 2, "C": 2}
    assert (found["settings"]["elbows"], found["settings"]["duration"]) == (1, 2.1)


def test_receipt_is_verified_to_the_last_bit_here_from_a_line_or_a_file(line, tmp_path, capsys):
    path = tmp_path / "receipt.json"
    path.write_text(line)
    verify_receipt(str(path), trust=False)
    assert "PPO, 24 V: verified to the last bit on the same machine, versions and code: A " in capsys.readouterr().out


def altered(line, **changes):
    return json.loads(line) | changes


def nudged(line, factor):
    found = json.loads(line)
    found["joules"]["B"][1] *= factor
    return found | {"digest": "0"}


def test_last_bit_counts_on_the_same_machine(line):
    found = nudged(line, 1.0 + 1e-12)
    with pytest.raises(ValueError, match=r"^results must be the receipt's to the last bit .* regime B, seed 20001: "):
        verify(found, player_again(found))


def test_a_millionth_counts_elsewhere(line):
    found = nudged(line, 1.0 + 1e-9) | {"machine": {"processor": "another"}}
    said = verify(found, player_again(found))
    assert said.startswith("verified to 1e-09 relative, within 1e-06 with other machine: A ")
    found = nudged(line, 1.0 + 1e-5) | {"versions": {}}
    with pytest.raises(ValueError, match=r"^energies must be the receipt's to 1e-06, got 1e-05 with other versions; "):
        verify(found, player_again(found))


def test_nan_on_a_receipt_is_no_agreement(line):
    found = altered(line, code="another")
    found["joules"]["A"][0] = float("nan")
    with pytest.raises(ValueError, match=r"^energies must be the receipt's to 1e-06, got inf"):
        verify(found, player_again(found))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"player": "0"}, "player of the receipt must have the digest 0, got "),
        ({"settings": {}}, "elbows of the receipt must be 1 here, got 2"),
        ({"what": "nobody"}, "player must be one of "),
    ],
)
def test_other_player_or_other_settings_are_refused(line, changes, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        player_again(altered(line, **changes))


def test_an_argument_that_a_receipt_does_not_know_has_its_default(line):
    settings = dict(read_receipt(line)["settings"])
    del settings["task_observation"]
    player_again(altered(line, settings=settings))
    with pytest.raises(ValueError, match=r"^more of the receipt must be None here, got 1$"):
        player_again(altered(line, settings={**settings, "more": 1}))


@pytest.mark.parametrize("word", ["nothing.json", "{", "[" * 100_000, "[]", '{"what": "pd"}'])
def test_what_is_no_receipt_is_refused(word):
    with pytest.raises(ValueError, match=r"^receipt must "):
        read_receipt(word)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"what": 3}, "what of the receipt must be a name, got 3"),
        ({"elbows": True}, "elbows of the receipt must be a number, joints or null, got True"),
        ({"settings": None}, "settings of the receipt must be an object, got None"),
        ({"seeds": []}, "seeds of the receipt must be whole numbers from 0 on, at least one, got "),
        ({"seeds": [1.5, 2]}, "seeds of the receipt must be whole numbers from 0 on, at least one, got "),
        ({"joules": {"A": [1.0, 2.0]}}, "joules of the receipt must be of the regimes A, B, C, got "),
        ({"joules": {"A": [1.0], "B": [1.0], "C": [1.0]}}, "joules of regime A must be one for each seed, got 1 of 2"),
        ({"joules": {"A": [1.0, 10**400], "B": [], "C": []}}, "joules of regime A must be finite numbers, got "),
    ],
)
def test_entry_of_another_kind_is_named(line, changes, message):
    with pytest.raises(ValueError, match=rf"^{message}"):
        read_receipt(json.dumps(altered(line, **changes)))


def test_arguments_that_no_environment_has_are_named(line):
    with pytest.raises(ValueError, match=r"^arguments of the receipt must be an environment's, got \{'foo': 1\}"):
        player_again(altered(line, arguments={"foo": 1}))


def test_digest_covers_every_metric(line):
    player = player_again(json.loads(line))
    results = receipts.in_all_regimes(player, [20_000, 20_001])
    before = receipts._digest(results)
    assert before == json.loads(line)["digest"]
    results["C"]["error_max"] = results["C"]["error_max"] * (1.0 + 1e-15)
    assert receipts._digest(results) != before
