"""Soft actor-critic with quadratic critics."""
