"""The project's structure: who imports whom, where compiled code and words stand, and what a wheel holds."""

import ast
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
BENCHMARKS = r"(^|/)benchmarks(/|$)"
WRITER = r"write_\w+|save\w*|mkdir|touch|rename|copy\w*|move|unlink|rmtree"
"""Names of functions that write, move or remove files; so does `open` with a mode."""
LEARNING = ("torch", "stable_baselines3", "matplotlib", "tensorboard")


def loaded_by(statements, *names):
    """Which of the modules a fresh process has loaded after the statements."""
    code = f"import sys; {statements}; print(*[name for name in {names} if name in sys.modules])"
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()


def test_rooms_and_floors_import_only_from_below(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename="pyproject.toml", no_cache=True) == 0


def test_importing_the_package_loads_nothing_heavy():
    assert loaded_by("import elbow_gym", "numba", "pygame", "scipy", *LEARNING) == []


def test_a_policy_plays_without_a_learning_library():
    play = "import elbow_gym; p = elbow_gym.load_policy('ppo', elbows=2); p.predict([0.0] * p.card.layers[0])"
    assert loaded_by(play, *LEARNING) == []


def test_the_kernel_and_one_file_of_the_learning_know_the_compiler():
    imports = nodes("", (ast.Import, ast.ImportFrom), "numba")
    importing = {path for path, node in imports if "numba" in imported_by(node)}
    beside = {path for path in importing if not path.startswith("elbow_gym/kernel/")}
    assert beside == {"agents/learning/compiled.py"} < importing


def test_no_file_is_over_300_lines():
    assert [path for path, text in SOURCES.items() if len(text.splitlines()) > 300] == []


def test_every_module_says_what_it_is():
    """Of a package an empty `__init__.py` says nothing; what is in one stands under a docstring."""
    assert [path for path, text in SOURCES.items() if text.strip() and not text.startswith('"""')] == []


def nodes(room, kind, word=""):
    """Every syntax node of a kind in the files under a folder in which a word stands, with its file."""
    for path, text in SOURCES.items():
        if path.startswith(room) and word in text:
            yield from ((path, node) for node in ast.walk(ast.parse(text)) if isinstance(node, kind))


def imported_by(node):
    """Top-level packages that an import statement loads."""
    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    return {name.partition(".")[0] for name in names}


def writes_files(call):
    name = ast.unparse(call.func).rpartition(".")[2]
    given_mode = call.args or any(keyword.arg == "mode" for keyword in call.keywords)
    return re.fullmatch(WRITER, name) or (name == "open" and given_mode)


def test_agents_write_nothing_under_benchmarks_and_the_report_alone_reads_there():
    # A path is a string with this part; in prose the word has a space before or behind it.
    named = {path for path, node in nodes("agents/", ast.Constant) if re.search(BENCHMARKS, str(node.value))}
    assert named == {"agents/report/command.py"}
    # The report writes one file, where its user says.
    writes = [
        (path, ast.unparse(node.args[0])) for path, node in nodes("agents/report/", ast.Call) if writes_files(node)
    ]
    assert writes == [("agents/report/command.py", "output")]


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
