"""Controllers, training, evaluation and the reproduction of the paper: `python -m agents`."""
