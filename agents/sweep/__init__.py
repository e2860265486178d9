"""Sweeps: algorithms, elbows, settings and environments compared over seeds, and the best of them trained."""
