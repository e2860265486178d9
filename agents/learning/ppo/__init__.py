"""Proximal policy optimisation with its gradient in closed form."""
