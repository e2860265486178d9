import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

import elbow_gym

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # comes with pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted(
    path.relative_to(ROOT).as_posix()
    for room in ("elbow_gym", "agents", "benchmarks")
    for path in (ROOT / room).rglob("*.py")
)
MODULES = [path for path in SOURCES if path.startswith("elbow_gym/") and not path.endswith("__init__.py")]


def test_rooms_and_floors_import_only_from_below(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", no_cache=True) == 0


def test_importing_the_package_loads_nothing_heavy():
    heavy = ["numba", "pygame", "torch", "scipy", "matplotlib", "stable_baselines3"]
    code = f"import sys, elbow_gym; print([name for name in {heavy} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert ran.stdout == "[]\n"


def test_compiled_code_stands_in_the_kernel_alone():
    assert [path for path in MODULES if "numba" in (ROOT / path).read_text().lower()] == ["elbow_gym/kernel.py"]


@pytest.mark.parametrize("path", [path for path in SOURCES if path != "elbow_gym/kernel.py"])
def test_no_file_but_the_kernel_is_over_300_lines(path):
    assert len((ROOT / path).read_text().splitlines()) <= 300


@pytest.mark.parametrize("path", MODULES)
def test_every_module_says_what_it_is(path):
    assert (ROOT / path).read_text().startswith('"""')


@pytest.mark.parametrize("name", elbow_gym.__all__)
def test_public_name_resolves_and_is_documented(name):
    assert inspect.getdoc(getattr(elbow_gym, name))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"^module 'elbow_gym' has no attribute 'ElbowLeg'$"):
        _ = elbow_gym.ElbowLeg


def test_wheel_holds_the_package_alone():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"] == {"packages": ["elbow_gym"]}
    # Anything else here, such as force-include, would add files to every target.
    assert set(build) == {"targets", "dev-mode-dirs"}
