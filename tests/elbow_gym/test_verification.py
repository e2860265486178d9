"""`python -m elbow_gym verify` and `info`: every check passes here, and notices what it is for."""

import errno
import json
from dataclasses import fields

import numpy as np
import pytest

from elbow_gym import __main__ as program
from elbow_gym import verification
from elbow_gym.__main__ import main
from elbow_gym.task.settings import Settings
from elbow_gym.verification import CHECKS, GOLDEN, ROLLOUTS, accelerations, ids


@pytest.mark.slow
def test_every_check_passes_with_a_line_each(capsys):
    main(["verify"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == [f"ok    {name}" for name in CHECKS]


def test_a_failed_check_is_a_line_and_an_exit_code_and_the_others_go_on(capsys, monkeypatch):
    def broken():
        raise AssertionError("the rollout must be another")

    monkeypatch.setattr(verification, "CHECKS", {"golden rollouts": broken, "versions": verification.versions})
    with pytest.raises(SystemExit, match="1"):
        main(["verify"])
    first, second = capsys.readouterr().out.splitlines()
    assert first == "FAIL  golden rollouts: AssertionError: the rollout must be another"
    assert second.startswith("ok    versions: elbow_gym ")


def test_a_rollout_that_differs_in_a_bit_fails(tmp_path, monkeypatch):
    known = json.loads(GOLDEN.read_text())
    assert set(known) == set(ROLLOUTS)
    other = tmp_path / "golden.json"
    other.write_text(json.dumps(known | {"elbows 1": known["elbows 2"]}))
    monkeypatch.setattr(verification, "GOLDEN", other)
    with pytest.raises(AssertionError, match="the rollout with elbows 1 must have the hash "):
        verification.golden_rollouts()


@pytest.mark.parametrize("check", [verification.printed_form, verification.static_forces])
@pytest.mark.parametrize("part", [0, 1])
def test_a_fast_form_that_is_off_by_a_billionth_fails(check, part, monkeypatch):
    def off(*state):
        answer = list(accelerations(*state))
        answer[part] = answer[part] + 1e-7 * (1.0 + np.abs(answer[part]))
        return answer

    monkeypatch.setattr(verification, "accelerations", off)
    with pytest.raises(AssertionError, match=r"must agree to 1e-09, got "):
        check()


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (KeyboardInterrupt(), 130),
        (BrokenPipeError(), 1),
        (OSError(errno.ENOSPC, "No space left on device"), "error: No space left on device"),
    ],
)
def test_interrupted_program_and_one_whose_output_is_not_taken_end_without_a_traceback(
    error, code, monkeypatch, tmp_path
):
    def interrupted(_):
        raise error

    with (tmp_path / "output").open("w") as output:
        monkeypatch.setattr(program, "main", interrupted)
        monkeypatch.setattr("sys.stdout", output)
        with pytest.raises(SystemExit) as ended:
            program.run([])
        assert ended.value.code == code


def test_info_tells_ids_arguments_and_observations(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    main(["info"])
    told = capsys.readouterr().out
    assert all(f"\n  {name}" in told for name in [*ids(), *(field.name for field in fields(Settings))])
    assert "\n  lookahead_error  36..38   m      0.5    10.0   hand minus the target 0.1 s later" in told


def test_info_keeps_to_the_terminals_width(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    main(["info"])
    told = capsys.readouterr().out.splitlines()
    # The path of the cache is the last line.
    assert max(map(len, told[:-1])) <= 80
    first = next(k for k, line in enumerate(told) if line.startswith("  arm "))
    assert told[first + 1].split() == ["`ArmParameters`,", "or", "its", "JSON", "dict"]
