"""Recipes: one file a library of reinforcement learning, each with a training on this environment and its pinned set.

The sets can't all be installed together, so each recipe has a virtual environment of its own, with the pinned
packages, this project's (`numba scipy safetensors`) and the checkout as folder of work or in PYTHONPATH. Every recipe
has `train(steps, seed, after_update)`, and `python -m agents.recipes.NAME` trains until the policy is below the
paper's PD in energy and in error, see `race`. No recipe is imported by other parts of the project.
"""
