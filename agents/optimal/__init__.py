"""Bound on the return, by optimal control."""
