"""Benchmarks of energy, learning, the optimum and speed: `python -m benchmarks`."""
