"""Commands of the benchmarks: what they hand on of the command line."""

import pytest

from benchmarks.__main__ import app


@pytest.mark.parametrize("name", ["energy", "speed"])
def test_results_record_the_words_that_were_parsed(name, monkeypatch):
    found = {}
    place = {"energy": "benchmarks.energy.own.energy"}.get(name, f"benchmarks.{name}.run.{name}")
    monkeypatch.setattr(place, lambda *_, command, **__: found.update(command=command))
    monkeypatch.setattr("sys.argv", ["benchmarks", "other", "--words"])
    app.run([name, "--output", "a b"])
    assert found == {"command": f"python -m benchmarks {name} --output 'a b'"}
