"""Reproduction of the paper's results, and the same comparison on a table that cannot pull."""
