"""The README's snippets run, its table is the committed one, and what it names exists."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def test_readme_has_its_snippets():
    assert len(SNIPPETS) == 1


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_readme_snippet_runs(snippet):
    exec(compile(snippet, "README.md", "exec"), {"__name__": "readme"})


def test_energy_table_in_the_benchmarks_readme_is_the_committed_one():
    page = (ROOT / "benchmarks/README.md").read_text(encoding="utf-8")
    table = page.split("<!-- energy:begin -->\n")[1].split("<!-- energy:end -->")[0]
    assert table == (ROOT / "benchmarks/results/energy_brief.md").read_text(encoding="utf-8")


def test_breakdown_in_the_benchmarks_readme_is_the_committed_one():
    page = (ROOT / "benchmarks/README.md").read_text(encoding="utf-8")
    table = page.split("<!-- breakdown:begin -->\n")[1].split("<!-- breakdown:end -->")[0]
    assert table == (ROOT / "benchmarks/results/breakdown.md").read_text(encoding="utf-8")


def test_learning_table_in_the_benchmarks_readme_is_the_committed_one():
    page = (ROOT / "benchmarks/README.md").read_text(encoding="utf-8")
    table = page.split("<!-- learning:begin -->\n")[1].split("<!-- learning:end -->")[0]
    assert table == (ROOT / "benchmarks/results/learning.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", re.findall(r"!\[[^]]*\]\(([^)]+)\)|`((?:tests|benchmarks|agents)/[\w./]+)`", README))
def test_files_that_the_readme_names_exist(path):
    assert (ROOT / (path[0] or path[1])).exists()


@pytest.mark.parametrize("name", re.findall(r"`((?:dynamics|kinematics|circle)\.(?!py`)\w+)`", README))
def test_functions_that_the_readme_names_exist(name):
    module, attribute = name.split(".")
    assert callable(getattr(import_module(f"elbow_gym.{module}"), attribute))


def test_commands_that_the_readme_names_have_help():
    commands = set(re.findall(r"python -m (agents|benchmarks) (\w+)", README))
    assert {("agents", "reproduce"), ("agents", "train"), ("benchmarks", "energy")} <= commands
    for package, command in sorted(commands):
        done = subprocess.run(
            [sys.executable, "-m", package, command, "--help"], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert "usage" in done.stdout
