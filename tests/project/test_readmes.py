"""READMEs of the rooms: their snippets run, and what all READMEs say agrees with the code and the committed results."""

import csv
import inspect
import itertools
import json
import math
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import elbow_gym
from agents.__main__ import app as agents_app
from agents.control.inverse_dynamics import InverseDynamics
from agents.control.trajectory import Trajectory
from agents.learning.presets import DEFAULTS, default_settings
from agents.shipped import OPTIMA
from agents.style import CONTROLLER_NAMES
from benchmarks.__main__ import app as benchmarks_app
from elbow_gym import ElbowArmEnv
from elbow_gym.task.settings import Settings

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results"
PAGES = {
    name: (ROOT / name).read_text(encoding="utf-8")
    for name in ("README.md", "elbow_gym/README.md", "agents/README.md", "benchmarks/README.md")
}
ROOMS = [name for name in PAGES if name != "README.md"]
NAMES = {label: name for name, label in CONTROLLER_NAMES.items()}
PD, LQR = NAMES["PD, 24 V"], NAMES["LQR on the optimum"]
COMMANDS = ('pip install -e ".[agents]" && python -m benchmarks energy', 'pip install -e ".[dev]" && pytest')


def block(page, name):
    """Lines between the comments that name a block."""
    return PAGES[page].split(f"<!-- {name}:begin -->\n")[1].split(f"<!-- {name}:end -->")[0].splitlines()


def cells(line):
    return [cell.strip() for cell in line.strip("| ").split("|")]


def rows(path):
    with path.open(encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


def prose(page):
    """The text without fenced and quoted code, tables, comments and the targets of links."""
    text = re.sub(r"```.*?```|`[^`]*`|<!--.*?-->|\]\([^)]*\)", "", PAGES[page], flags=re.DOTALL)
    return "\n".join(line for line in text.splitlines() if not line.startswith("|"))


SNIPPETS = [
    pytest.param(page, snippet, id=f"{page}-{k}")
    for page in ROOMS
    for k, snippet in enumerate(re.findall(r"```python\n(.*?)```", PAGES[page], flags=re.DOTALL), start=1)
]


@pytest.mark.parametrize(("page", "snippet"), SNIPPETS)
def test_snippet_of_a_room_runs(page, snippet, tmp_path, monkeypatch):
    if "stable_baselines3" in snippet:
        pytest.importorskip("stable_baselines3")
    monkeypatch.chdir(tmp_path)
    exec(compile(snippet, page, "exec"), {"__name__": "readme"})


def test_every_room_has_a_snippet_where_it_has_an_interface():
    assert [PAGES[page].count("```python\n") for page in PAGES] == [1, 15, 2, 0]


def test_readme_is_short_and_has_the_two_commands():
    lines = PAGES["README.md"].splitlines()
    assert len(lines) <= 120
    assert [command for command in COMMANDS if command in lines] == list(COMMANDS)


def heading(line):
    """GitHub's anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files_and_headings(page):
    for target in re.findall(r"\]\(([^)]+)\)", PAGES[page]):
        path, _, anchor = target.partition("#")
        found = (ROOT / page).parent / path if path else ROOT / page
        assert found.exists(), target
        if anchor:
            heads = re.findall(r"^#+ .*$", found.read_text(encoding="utf-8"), flags=re.MULTILINE)
            assert anchor in map(heading, heads), target


@pytest.mark.parametrize("page", PAGES)
def test_commands_that_a_page_names_exist(page):
    known = {"agents": agents_app.help(), "benchmarks": benchmarks_app.help()}
    for program, command in re.findall(r"python -m (agents|benchmarks) ([a-z]+)", PAGES[page]):
        assert re.search(rf"^  {command} ", known[program], flags=re.MULTILINE), (program, command)


@pytest.mark.parametrize("page", PAGES)
def test_command_lines_of_the_agents_that_a_page_quotes_are_accepted(page):
    quoted = re.findall(r"(?:^|`)python -m agents ([a-z][^`\n]*)", PAGES[page], flags=re.MULTILINE)
    for line in quoted:
        agents_app.parse(shlex.split(line))
    assert len(quoted) >= {"README.md": 4, "agents/README.md": 10}.get(page, 0)


def energy(file="energy.csv"):
    return {(row["controller"], int(row["elbows"]), row["regime"]): row for row in rows(RESULTS / file)}


def saved(controller):
    """Share of the energy of a whole run that two elbows save [%]."""
    two, none = (float(energy()[controller, elbows, "A"]["electrical_energy [J]"]) for elbows in (2, 0))
    return 100.0 * (1.0 - two / none)


def within(controller):
    """Whole percent that a controller's gap stays within at every elbow count."""
    return math.ceil(
        max(100.0 * float(energy()[controller, elbows, "A"]["optimality_gap [-]"]) for elbows in (2, 1, 0))
    )


def off_tasks(controller):
    """Median gaps to the optima of the evaluation tasks [%], two elbows first."""
    found = [row for row in rows(RESULTS / "tasks.csv") if row["controller"] == controller]
    assert [(row["elbows"], row["tasks [-]"]) for row in found] == [("2", "50"), ("1", "50"), ("0", "50")]
    return [100.0 * float(row["gap_median [-]"]) for row in found]


def on_table(controller):
    return float(energy("energy_table.csv")[controller, 0, "B"]["electrical_energy [J]"])


def batch_step():
    """Time of a step in a batch with two elbows on one thread [us], and MuJoCo's RK4 step over it [-]."""
    for row in rows(RESULTS / "speed.csv"):
        key = (row["who"], row["what"], row["unit"], row["joints"], row["elbows"])
        if key == ("elbow_gym", "batch", "exponential step", "10", "2"):
            return float(row["median [us]"]), float(row["MuJoCo / this"])
    raise AssertionError


def at_equal_accuracy():
    """CPU time of MuJoCo's best integrator over that of the environment's steps, at a state error of 1e-4 [-].

    Of a single arm, and of an arm in a batch.
    """
    lines = map(cells, block("benchmarks/README.md", "precision"))
    ratios = {line[2]: float(line[5]) for line in lines if line[1] == "exponential, growing steps"}
    single, batch = (ratios[arms] for arms in ("1", "64"))
    return single, batch


# Sentences of the README with a {} for each figure, and the figures as the committed results have them.
CLAIMS = {
    "two elbows save {} % of the PD's energy and {} % of the LQR's": lambda: (saved(PD), saved(LQR)),
    "PPO comes within {} % of the best return known, SAC within {} %": lambda: (within("ppo"), within("sac")),
    "comes within {} % of the [optima": lambda: (math.ceil(max(off_tasks("newton_tasks"))),),
    "with two elbows PPO costs {} % more": lambda: (off_tasks("ppo")[0],),
    "once on the circle the PD needs {} J, and PPO {} J": lambda: (on_table(PD), on_table("ppo")),
    "takes {} us on one core, which is {} times faster": batch_step,
    "an arm is {} times faster than MuJoCo's best integrator, a batch {}.": at_equal_accuracy,
}


@pytest.mark.parametrize("claim", CLAIMS)
def test_figures_in_the_readmes_prose_are_those_of_the_committed_results(claim):
    pattern = r"\s+".join(re.escape(word).replace(r"\{\}", r"([\d.]+)") for word in claim.split())
    found = [match.groups() for match in re.finditer(pattern, prose("README.md"))]
    assert len(found) == 1, claim
    for quoted, value in zip(found[0], CLAIMS[claim](), strict=True):
        decimals = len(quoted.partition(".")[2])
        assert float(quoted) == pytest.approx(round(value, decimals), abs=1e-9), claim


def test_gaps_on_tasks_of_other_seeds_are_told_as_they_were_played():
    text = " ".join(prose("benchmarks/README.md").split())
    three = r"([\d.]+), ([\d.]+) and ([\d.]+) %"
    (quoted,) = re.findall(
        rf"{three} above the optima in the median with two, one and no elbow, {three} at the 90th", text
    )
    played = rows(RESULTS / "tasks_770000.csv")
    table = {int(row["elbows"]): row for row in played if row["controller"] == "newton_tasks"}
    told = [float(table[elbows][f"gap_{name} [-]"]) for name in ("median", "tail") for elbows in (2, 1, 0)]
    for figure, gap in zip(quoted, told, strict=True):
        assert float(figure) == pytest.approx(100.0 * gap, abs=0.0501)
    assert {(row["tasks [-]"], row["failures [-]"]) for row in table.values()} == {("50", "0")}


def test_gaps_of_the_planner_and_losses_by_an_untold_load_are_told_as_they_were_played():
    text = " ".join(prose("benchmarks/README.md").split())
    (gaps,) = re.findall(r"with median gaps of ([\d.]+), ([\d.]+) and ([\d.]+) %", text)
    for figure, gap in zip(gaps, off_tasks("receding_horizon_payload"), strict=True):
        assert float(figure) == pytest.approx(gap, abs=0.0501)
    (losses,) = re.findall(
        r"is not told costs the policies of drawn tasks (\d+) % .*? and computed torque (\d+) %", text
    )
    table = {row["controller"]: row for row in rows(RESULTS / "tasks.csv") if row["elbows"] == "2"}
    for figure, who in zip(losses, ("newton_tasks", "computed_torque"), strict=True):
        assert float(figure) == round(100.0 * float(table[who]["loss_payload [-]"]))


def test_prose_of_the_readme_has_at_most_a_dozen_figures_and_all_are_compared():
    figures = re.findall(r"(?<![\w.])\d[\d.,]*", prose("README.md"))
    assert len(figures) == sum(claim.count("{}") for claim in CLAIMS) <= 12


def test_learning_beats_the_pd_within_a_minute_at_every_elbow_count_as_the_readme_says():
    learned = [row for row in rows(RESULTS / "learning.csv") if row["controller"] in ("ppo", "sac")]
    learned = [row for row in learned if row["task"].startswith("elbows")]
    assert len(learned) == 6
    assert all(row["beat the PD"] == row["seeds"] and float(row["training seconds"]) < 60.0 for row in learned)


def test_results_in_the_readme_are_the_committed_figures():
    head, _, *lines = block("README.md", "energy")
    assert len(lines) <= 8
    counts = {"two elbows": 2, "one elbow": 1, "no elbow": 0}
    columns = {
        "energy": ("electrical_energy [J]", 1.0),
        "gap": ("optimality_gap [-]", 100.0),
        "error": ("error_rms [mm]", 1.0),
    }
    for line in lines:
        controller, *figures = cells(line)
        for title, figure in zip(cells(head)[1:], figures, strict=True):
            quantity, regime, elbows = re.fullmatch(r"(\w+) (\w), ([a-z ]+?)( \(\w+\))?", title).groups()[:3]
            column, scale = columns[quantity]
            value = scale * float(energy()[NAMES[controller], counts[elbows], regime][column])
            assert float(figure.removesuffix(" %")) == pytest.approx(value, rel=5e-3), (controller, title)


def test_versions_in_the_readme_are_those_of_the_speed_benchmark():
    made = json.loads((RESULTS / "speed.json").read_text(encoding="utf-8"))
    quoted = dict(re.findall(r"([a-z][\w-]+) (\d+\.\d+)", re.search(r"\| libraries \| (.*) \|", PAGES["README.md"])[1]))
    assert quoted
    assert quoted == {name: ".".join(made["versions"][name].split(".")[:2]) for name in quoted}
    assert f"| Python | {'.'.join(made['machine']['python'].split('.')[:2])};" in PAGES["README.md"]


@pytest.mark.parametrize(("name", "section"), [("arguments", "Arguments"), ("observations", "Observation Space")])
def test_tables_of_the_environment_are_those_of_its_docstring(name, section):
    part = inspect.getdoc(ElbowArmEnv).split(f"## {section}\n")[1].split("\n## ")[0]
    assert block("elbow_gym/README.md", name) == [line for line in part.splitlines() if line.startswith("|")]


def test_infos_of_the_environment_are_documented():
    env = ElbowArmEnv(
        table=True, elbow_friction=0.1, heat=True, supply_resistance=0.1, randomize={"payload": [0.0, 0.1]}
    )
    table = PAGES["elbow_gym/README.md"].split("| info |")[1].split("\n\n")[0]
    named = {name for line in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", cells(line)[0])}
    assert named - {"circle", "start"} == set(env.reset(seed=0)[1])


def test_front_of_the_objectives_is_that_of_the_committed_optima():
    head, _, *lines = block("elbow_gym/README.md", "front")
    assert cells(head)[:2] == ["elbows", "energy_weight"]
    optima = {
        (row["elbows"], row["energy_weight"]): row
        for row in rows(RESULTS / "optimal.csv")
        if row["start"] == "paper" and row["under"] == "False"
    }
    found = {}
    for line in lines:
        elbows, weight, error, power = cells(line)
        row = optima.pop((elbows, weight))
        # 250 control periods of 0.02 s.
        assert float(error) == pytest.approx(-250.0 * float(row["error_mean"]), rel=1e-3)
        assert float(power) == pytest.approx(-50.0 * float(row["energy"]), rel=1e-4)
        found.setdefault(elbows, []).append((float(error), float(power)))
    assert not optima
    for points in found.values():
        assert len(points) > 1
        assert all((a[0] - b[0]) * (a[1] - b[1]) < 0.0 for a, b in itertools.combinations(points, 2))


def test_reference_point_of_the_hypervolume_is_worse_than_doing_nothing_and_than_the_pd():
    quoted = re.search(r"the hypervolume is \((-?\d+), (-?\d+)\)", PAGES["elbow_gym/README.md"]).groups()
    error, power = map(float, quoted)
    for elbows in (0, 1, 2):
        arms = elbow_gym.MOElbowArmVectorEnv(8, elbows=elbows)
        arms.reset(seed=0)
        idle = sum(arms.step(np.zeros(arms.action_space.shape))[1] for _ in range(arms.settings.horizon))
        assert (idle > (error, power)).all()
        pd = energy()[PD, elbows, "A"]
        assert -50.0 * float(pd["electrical_energy [J]"]) > power
        assert -0.25 * float(pd["error_mean [mm]"]) > error


def test_training_defaults_are_the_presets():
    lines = [cells(line) for line in block("agents/README.md", "settings")[2:]]
    assert {(algorithm, task) for algorithm, task, *_ in lines} >= set(DEFAULTS)
    for algorithm, task, steps, arms, gamma, hidden in lines:
        settings = default_settings(algorithm, task)
        assert int(steps.replace(" ", "")) == settings.total_timesteps
        assert (int(arms), float(gamma)) == (settings.num_envs, settings.gamma)
        assert tuple(map(int, hidden.split(", "))) == settings.hidden


def test_trials_have_distinct_ids_and_build_on_each_other():
    trials = rows(RESULTS / "trials.csv")
    header = ["id", "task", "algorithm", "base", "change", "seed", "steps", "return", "energy", "rms", "note"]
    assert list(trials[0]) == header
    ids = [trial["id"] for trial in trials]
    assert len(set(ids)) == len(ids)
    numbers = {int(re.match(r"\d+", name)[0]) for name in ids}
    assert numbers == set(range(1, max(numbers) + 1))
    number = r"-?[\d.]+"
    for trial in trials:
        assert trial["base"] in {"", *ids} - {trial["id"]}
        assert trial["change"]
        assert re.fullmatch(r"\d*", trial["steps"])
        for column in ("return", "energy", "rms"):
            assert re.fullmatch(rf"({number}( to {number})?)?", trial[column]), trial


def test_lessons_name_trials_that_are_there():
    lessons = PAGES["agents/README.md"].split("### What the trials taught")[1].split("\n## ")[0]
    named = [
        name for names in re.findall(r"\((\d+[a-z]?(?:,\s+\d+[a-z]?)*)\)", lessons) for name in re.split(r",\s+", names)
    ]
    ids = {trial["id"] for trial in rows(RESULTS / "trials.csv")}
    assert len(named) > 20
    assert set(named) <= ids


def test_leaning_on_two_joints_of_a_compliant_table_saves_nine_tenths():
    found = {(row["friction [-]"], row["start"]): float(row["energy_tracking [J]"]) for row in _table_numbers()}
    for friction in {friction for friction, _ in found}:
        assert found[friction, "joints 4 and 7"] < 0.1 * found[friction, "clear"]


def _table_numbers():
    return rows(ROOT / "agents" / "paper" / "results" / "table_numbers.csv")


def test_space_under_the_table_is_worth_what_the_benchmarks_readme_says():
    cost = {
        (int(row["elbows"]), row["under"]): float(row["closed_loop"])
        for row in rows(RESULTS / "optimal.csv")
        if row["start"] == "paper" and row["energy_weight"] == "0.001"
    }
    quoted = re.search(
        r"about (\d+) % of the return with one elbow and\s+(\d+) %\s+with none", PAGES["benchmarks/README.md"]
    )
    for elbows, percent in zip((1, 0), quoted.groups(), strict=True):
        assert round(100.0 * (1.0 - cost[elbows, "True"] / cost[elbows, "False"])) == int(percent)


def test_optima_pay_less_than_their_postures_at_rest_and_fold_as_the_benchmarks_readme_says():
    quoted = re.search(
        r"pay (\d+) % less with one elbow, and (\d+) % less\s+with none", PAGES["benchmarks/README.md"]
    ).groups()
    for elbows, percent in zip((1, 0, 2), (*quoted, None), strict=True):
        settings = Settings(elbows=elbows)
        inverse = InverseDynamics(settings.parsed_arm, settings.elbow_joints)
        optimum = Trajectory.load(OPTIMA / f"elbows{elbows}.npz")
        moving, resting = (
            (inverse.resistance * current[101:] ** 2).sum(axis=-1).mean()
            for current in (optimum.current, inverse.hold(optimum.q).current)
        )
        assert percent is None or round(100.0 * (1.0 - moving / resting)) == int(percent)
        start, folded = (inverse.torque(q, np.zeros(10), np.eye(10)[0])[0] for q in optimum.q[[0, 10]])
        assert folded < 0.605 * start
