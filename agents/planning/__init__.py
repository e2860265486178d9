"""Planners: controllers that look ahead with a model of the arm in every control period."""
