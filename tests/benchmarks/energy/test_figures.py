"""The figure of the comparison: axes that can be read where all controllers are alike."""

import pytest

from agents.evaluation.interquartile import Estimate
from agents.evaluation.metrics import REGIMES, UNITS
from agents.style import pyplot
from benchmarks.energy.figures import LEAST_SPAN, figure
from benchmarks.energy.rows import Row


@pytest.mark.slow
def test_axes_of_controllers_that_are_alike_span_a_decade_and_have_ticks(tmp_path, monkeypatch):
    rows = [
        Row(name, 1, regime.name, dict.fromkeys(UNITS, Estimate(value, value, value)), ())
        for name, value in (("pd", 1.829), ("computed_torque", 1.830))
        for regime in REGIMES
    ]
    kept = []
    monkeypatch.setattr(pyplot(), "close", kept.append)
    figure(rows, tmp_path / "energy.png")
    monkeypatch.undo()
    for axes in kept[0].axes:
        low, high = axes.get_xlim()
        assert high / low == pytest.approx(LEAST_SPAN)
        assert max(low, 1.829) < min(high, 1.830)
        assert [tick for tick in axes.get_xticks() if low < tick < high]
    pyplot().close(kept[0])
