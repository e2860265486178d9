"""The project's structure: who imports whom, where compiled code and words stand, and what a wheel holds."""

import inspect
import re
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
SOURCES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for room in ("elbow_gym", "agents", "benchmarks")
    for path in sorted((ROOT / room).rglob("*.py"))
}


def test_rooms_and_floors_import_only_from_below(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", no_cache=True) == 0


def test_importing_the_package_loads_nothing_heavy():
    heavy = ["numba", "pygame", "torch", "scipy", "matplotlib", "stable_baselines3"]
    code = f"import sys, elbow_gym; print([name for name in {heavy} if name in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert ran.stdout == "[]\n"


def test_compiled_code_stands_in_the_kernel_alone():
    package = {path: text for path, text in SOURCES.items() if path.startswith("elbow_gym/")}
    assert [path for path, text in package.items() if "numba" in text.lower()] == ["elbow_gym/kernel.py"]


def test_no_file_but_the_kernel_is_over_300_lines():
    long = [path for path, text in SOURCES.items() if len(text.splitlines()) > 300]
    assert long == ["elbow_gym/kernel.py"]


def test_every_module_says_what_it_is():
    """Of a package an empty `__init__.py` says nothing; what is in one stands under a docstring."""
    assert [path for path, text in SOURCES.items() if text.strip() and not text.startswith('"""')] == []


def test_public_names_resolve_and_are_documented():
    assert [name for name in elbow_gym.__all__ if not inspect.getdoc(getattr(elbow_gym, name))] == []
    assert "ElbowArmEnv" in elbow_gym.__all__


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"^module 'elbow_gym' has no attribute 'ElbowLeg'$"):
        _ = elbow_gym.ElbowLeg


def test_wheel_holds_the_package_alone():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"] == {"packages": ["elbow_gym"]}
    # Anything else here, such as force-include, would add files to every target.
    assert set(build) == {"targets", "dev-mode-dirs"}


def test_no_test_module_imports_another():
    found = [
        (path.relative_to(ROOT).as_posix(), name)
        for path in sorted((ROOT / "tests").rglob("*.py"))
        for name in re.findall(r"^\s*(?:from|import) +([\w.]+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        if re.search(r"(^|\.)test_\w+", name) or (name.startswith("tests") and not name.startswith("tests.support"))
    ]
    assert [name for path, name in found if name != "tests.make_golden"] == []
