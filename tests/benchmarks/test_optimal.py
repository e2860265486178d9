"""Cells of the bound: their names, and results that are taken over only where the problem is the same."""

import json

from benchmarks.optimal import Cell, cached, cells, files
from tests.support.trajectories import resting


def test_a_result_of_another_problem_is_not_taken_over(arm, tmp_path):
    cell = Cell(2)
    card, trajectory = files(cell, tmp_path)
    resting(arm).save(trajectory)
    for question, expected in ((cell.question, {"cost": 1.0}), ({**cell.question, "duration": 4.0}, None)):
        card.write_text(json.dumps({"problem": question, "figures": {"cost": 1.0}}))
        assert cached(cell, tmp_path) == expected


def test_cells_have_names_of_their_own():
    names = [cell.name for cell in cells()]
    assert len(set(names)) == len(names)
