"""Templates of the kernel: merged globals, names with a digest, and the names of rows without a compiler."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from elbow_gym import kernel
from elbow_gym.kernel import template
from elbow_gym.kernel.build import kernel as build_kernel
from elbow_gym.kernel.path import path
from elbow_gym.kernel.template import TEMPLATES

FILES = sorted(file.stem for file in Path(kernel.__file__).parent.glob("*.py") if file.stem != "__init__")


def test_importing_the_names_of_rows_loads_no_compiler():
    code = "import sys; import elbow_gym.kernel.rows; print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "False\n"


def test_no_two_files_of_the_kernel_bind_one_name_to_different_objects():
    # A kernel's templates share one set of globals, gathered from all files.
    bound = {}
    for name in FILES:
        for key, value in vars(import_module(f"elbow_gym.kernel.{name}")).items():
            if not key.startswith("__"):
                bound.setdefault(key, []).append((name, value))
    clashes = {
        key: [name for name, _ in places]
        for key, places in bound.items()
        if any(value is not places[0][1] and value != places[0][1] for _, value in places)
    }
    assert clashes == {}


def test_names_of_all_that_is_cached_carry_the_digest_of_all_sources(monkeypatch, tmp_path):
    cached = [*build_kernel(1), path]
    if not hasattr(cached[0], "py_func"):
        pytest.skip("nothing is cached without the compiler")
    assert all(entry.py_func.__qualname__.endswith(template.sources()) for entry in cached)


@pytest.mark.parametrize("changed", ["dense", "rows", "observe"])
def test_the_digest_changes_with_any_file(changed, monkeypatch, tmp_path):
    folder = Path(kernel.__file__).parent
    for name in FILES:
        (tmp_path / f"{name}.py").write_bytes((folder / f"{name}.py").read_bytes())
    (tmp_path / "__init__.py").write_bytes((folder / "__init__.py").read_bytes())
    monkeypatch.setattr(template, "__file__", str(tmp_path / "template.py"))
    assert template.sources.__wrapped__() == template.sources()
    with (tmp_path / f"{changed}.py").open("a") as file:
        file.write("# edited\n")
    assert template.sources.__wrapped__() != template.sources()


def test_templates_stay_plain_functions():
    # The passes can be read, called and stepped through as Python.
    out = np.zeros(1)
    sine, cosine = TEMPLATES["sincos"].function(0.5)
    out[0] = sine * sine + cosine * cosine
    assert out[0] == pytest.approx(1.0, rel=1e-15)
