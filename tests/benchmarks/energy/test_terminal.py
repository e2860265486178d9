"""The report on the terminal: 80 columns whatever the figures, three digits, and where the files are."""

from dataclasses import replace

import pytest

from agents.evaluation.interquartile import Estimate
from agents.evaluation.metrics import REGIMES, UNITS
from agents.style import CONTROLLER_NAMES
from benchmarks.energy.cells import FEATURED
from benchmarks.energy.markdown import percent, short, significant
from benchmarks.energy.rows import Row
from benchmarks.energy.terminal import WIDTH, meaning, report, table


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1260.4, "1260"),
        (-408.4, "-408"),
        (0.30871, "0.309"),
        (0.68, "0.680"),
        (99.96, "100"),
        (11_067.0, "11100"),
        (0.0, "0"),
        (-0.000123456, "-0.000123"),
        (float("nan"), "nan"),
    ],
)
def test_numbers_have_three_digits_and_no_exponent(value, text):
    assert significant(value) == text


def test_percentages_are_shares_times_a_hundred():
    assert percent(12.574) == "1260 %"
    assert percent(0.0108) == "1.08 %"


def rows(names, value=12_345.678, part="nominal", elbows=(2, 1, 0), regimes=REGIMES):
    figures = {name: Estimate(-value, -value, -value) for name in UNITS}
    gap = 98.765 if part == "nominal" else None
    return [
        Row(name, count, regime.name, figures, (), part, gap=gap)
        for name in names
        for count in elbows
        for regime in regimes
    ]


def test_every_line_fits_80_columns_with_the_longest_names_and_the_largest_figures():
    names = sorted(CONTROLLER_NAMES, key=lambda name: -len(CONTROLLER_NAMES[name]))
    everything = rows(names) + rows(names, part="shifted", regimes=REGIMES[:2]) + rows(names, part="table", elbows=(0,))
    lines = report(everything, 20, True, []).splitlines()
    assert max(len(line) for line in lines) <= WIDTH
    for name in names:
        assert sum(line.startswith(f"  {CONTROLLER_NAMES[name]} ") for line in lines) == 3 + 3 + 1


def test_columns_stand_under_their_heads_and_the_best_return_first():
    found = rows(["pd", "ppo"], 10.0, elbows=(2,), regimes=REGIMES)
    better = {"return": Estimate(-1.0, -1.0, -1.0), "electrical_energy": Estimate(5.0, 5.0, 5.0)}
    found = [replace(row, figures={**row.figures, **better}) if row.controller == "ppo" else row for row in found]
    head, units, first, second = table(found).splitlines()
    assert head.split() == ["two", "elbows", "return", "gap", "energy", "energy", "error", "energy"]
    assert units.split(maxsplit=2) == ["A", "A", "A, J    B, J   B, mm    C, J"]
    assert first.split() == ["PPO,", "24", "V", "-1.00", "9880", "%", "5.00", "5.00", "-10.0", "5.00"]
    assert second.split()[:3] == ["PD,", "24", "V"]
    assert {len(line) for line in (head, units, first, second)} == {len(head)}


def test_parts_without_regime_c_or_a_bound_leave_the_columns_out():
    head = table(rows(["pd"], part="shifted", elbows=(1,), regimes=REGIMES[:2])).splitlines()[0]
    assert head.split() == ["one", "elbow", "return", "energy", "energy", "error"]


def test_sentence_gives_the_energies_and_their_ratio():
    found = []
    for count, energy in ((2, 820.0), (0, 3280.0)):
        row = rows(["pd"], elbows=(count,), regimes=REGIMES[:1])[0]
        found.append(replace(row, figures={**row.figures, "electrical_energy": Estimate(energy, energy, energy)}))
    expected = "PD, 24 V takes 820 J with two elbows on the table and 3280 J with none, 4.00 times as much"
    assert expected in meaning(found)
    assert meaning(found[:1]) == ""


def test_report_ends_with_where_the_files_are(tmp_path):
    text = report(rows(["pd"]), 3, False, [tmp_path / "latest"])
    files = " ".join(text.split("\n\n")[-1].split())
    assert files.startswith(f"Files: {tmp_path / 'latest'} (energy.csv, energy.md, energy.png, effort.csv)")
    assert "interquartile mean over 3 start poses" in " ".join(text.split())


def test_files_below_the_working_folder_are_named_from_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Files: out/latest (energy.csv" in report(rows(["pd"]), 3, False, [tmp_path / "out" / "latest"])


def test_short_table_has_a_row_for_each_featured_controller_alone():
    lines = short(rows([*FEATURED, "clone", "pd_smooth"])).splitlines()
    assert len(lines) == 2 + len(FEATURED) <= 2 + 8
    assert {line.split(" | ")[0].strip("| ") for line in lines[2:]} == {CONTROLLER_NAMES[name] for name in FEATURED}


def test_what_is_not_in_the_report_is_not_explained():
    unbounded = report([replace(row, gap=None) for row in rows(["pd"])], 3, False, [])
    assert "Gap:" not in unbounded
    assert "learned" not in unbounded
    everything = " ".join(report([replace(row, seeds=({},)) for row in rows(["ppo"])], 3, False, []).split())
    assert "of learned controllers with the best training seed" in everything
    assert "Gap: excess over the least cost" in everything
