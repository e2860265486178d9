"""The project beside others: what the wheel holds, that it works and is typed by itself, and who owns a name."""

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "tests" / "support" / "user_script.py"


def run(*command, cwd, path=()):
    """The finished process of a command under its own PYTHONPATH."""
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}
    return subprocess.run([*map(str, command)], cwd=cwd, env=variables, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    built = run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Python of an environment with the wheel in it; it takes the libraries from the environment of the tests."""
    folder = tmp_path_factory.mktemp("user")
    venv.create(folder, symlinks=os.name != "nt")
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    where = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder).stdout.strip()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(where)
    # A .pth file in a folder that is added so is not read: the checkout of an editable installation stays out.
    Path(where, "libraries.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")
    return python


def test_wheel_holds_every_file_of_the_package_and_no_other(wheel):
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    files = {path.relative_to(ROOT).as_posix() for path in (ROOT / "elbow_gym").rglob("*") if path.is_file()}
    assert names == {name for name in files if "__pycache__" not in name}
    assert {"elbow_gym/py.typed", "elbow_gym/interface.py"} < names


@pytest.mark.soak
def test_pd_and_policy_of_the_wheel_play_without_the_checkout(installed, tmp_path):
    place = run(installed, "-c", "import elbow_gym; print(elbow_gym.__file__)", cwd=tmp_path).stdout.strip()
    assert Path(place).is_relative_to(installed.parents[1])
    assert run(installed, "-c", "import agents", cwd=tmp_path).returncode
    played = run(installed, SCRIPT, cwd=tmp_path)
    assert played.returncode == 0, played.stderr
    pd, policy, (force, period) = ([float(word) for word in line.split()] for line in played.stdout.splitlines())
    # Error [m] and energy [J]: learning beats the PD in both.
    assert 0.0 < policy[0] < pd[0] < 0.02
    assert 0.0 < policy[1] < pd[1]
    assert force > 0.0
    assert period == 0.02


@pytest.mark.soak
def test_wheel_passes_a_strict_type_checker_that_finds_faults(installed, tmp_path):
    pytest.importorskip("mypy")
    check = (sys.executable, "-m", "mypy", "--strict", "--python-executable", installed, "--cache-dir", "cache")
    passed = run(*check, SCRIPT, cwd=tmp_path)
    assert passed.returncode == 0, passed.stdout
    wrong = "import elbow_gym\nelbow_gym.Simulatr\nelbow_gym.load_policy(2)\nelbow_gym.paper_arm().n_joints + ''\n"
    found = run(*check, "-c", wrong, cwd=tmp_path).stdout
    assert [line.partition("[")[2] for line in found.splitlines()[:-1]] == ["attr-defined]", "arg-type]", "operator]"]


@pytest.fixture
def owner(tmp_path):
    """Folder of another distribution's package `agents`."""
    (tmp_path / "other" / "agents").mkdir(parents=True)
    (tmp_path / "other" / "agents" / "__init__.py").write_text("", encoding="utf-8")
    return tmp_path / "other"


@pytest.mark.parametrize("room", ["agents", "benchmarks"])
def test_commands_run_in_the_checkout_beside_another_package_named_agents(room, owner):
    shown = run(sys.executable, "-m", room, "--help", cwd=ROOT, path=[owner, ROOT])
    assert shown.returncode == 0, shown.stderr
    assert f"usage: python -m {room}" in shown.stdout


def test_benchmarks_name_another_package_named_agents(owner, tmp_path):
    refused = run(sys.executable, "-m", "benchmarks", "--help", cwd=tmp_path, path=[owner, ROOT])
    assert refused.returncode
    message = f"agents must be the package in {ROOT}, got that in {owner}; run the command in {ROOT}"
    assert refused.stderr.splitlines()[-1] == f"ImportError: {message}"
