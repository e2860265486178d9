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

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path.relative_to(ROOT).as_posix()
    for room in ("elbow_gym", "agents", "benchmarks")
    for path in (ROOT / room).rglob("*.py")
)
MODULES = [path for path in SOURCES if path.startswith("elbow_gym/") and not path.endswith("__init__.py")]
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


def test_compiled_code_stands_in_the_kernel_alone():
    known = [path for path in MODULES if "numba" in (ROOT / path).read_text().lower()]
    assert known
    assert all(path.startswith("elbow_gym/kernel/") for path in known)


@pytest.mark.parametrize("path", SOURCES)
def test_no_file_is_over_300_lines(path):
    assert len((ROOT / path).read_text().splitlines()) <= 300


@pytest.mark.parametrize("path", MODULES)
def test_every_module_says_what_it_is(path):
    assert (ROOT / path).read_text().startswith('"""')


def nodes(room, kind):
    """Every syntax node of a kind in the files under a folder, with its file."""
    for path in SOURCES:
        if path.startswith(room):
            yield from (
                (path, node) for node in ast.walk(ast.parse((ROOT / path).read_text())) if isinstance(node, kind)
            )


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
