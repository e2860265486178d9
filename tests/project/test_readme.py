"""The README's snippets run, its table is the committed one, and what it names exists."""

import re
import runpy
import sys
from importlib import import_module
from pathlib import Path

import pytest

from benchmarks.blocks import BLOCKS, block
from benchmarks.machine import RESULTS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def test_readme_has_its_snippets():
    assert len(SNIPPETS) == 1


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_readme_snippet_runs(snippet):
    exec(compile(snippet, "README.md", "exec"), {"__name__": "readme"})


def test_tables_of_the_readmes_are_the_committed_ones():
    for readme, blocks in BLOCKS.items():
        page = (ROOT / readme).read_text(encoding="utf-8")
        for name, file in blocks.items():
            assert block(page, name) == (RESULTS / file).read_text(encoding="utf-8")


def test_table_of_the_readme_has_at_most_eight_rows():
    assert len(block(README, "energy").splitlines()) <= 2 + 8


@pytest.mark.parametrize("path", re.findall(r"!\[[^]]*\]\(([^)]+)\)|`((?:tests|benchmarks|agents)/[\w./]+)`", README))
def test_files_that_the_readme_names_exist(path):
    assert (ROOT / (path[0] or path[1])).exists()


@pytest.mark.parametrize("name", re.findall(r"`((?:dynamics|kinematics)\.(?!py`)\w+)`", README))
def test_functions_that_the_readme_names_exist(name):
    module, attribute = name.split(".")
    assert callable(getattr(import_module(f"elbow_gym.{module}"), attribute))


COMMANDS = sorted(set(re.findall(r"python -m (agents|benchmarks) (\w+)", README)))


def test_readme_names_commands_of_both_packages():
    assert {("agents", "reproduce"), ("agents", "train"), ("benchmarks", "energy")} <= set(COMMANDS)


@pytest.mark.parametrize(("package", "command"), COMMANDS)
def test_commands_that_the_readme_names_have_help(package, command, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [package, command, "--help"])
    with pytest.raises(SystemExit) as ended:
        # As `python -m` does; in this process, whose libraries are loaded.
        runpy.run_path(str(ROOT / package / "__main__.py"), run_name="__main__")
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "usage" in told
    assert command in told
