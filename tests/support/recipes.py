"""Short trainings of the recipes, and the returns of what they have learned."""

from agents.recipes.race import Race


def returns_of(train, steps, **arguments):
    """Return of the deterministic policy at each of a training's updates."""
    race = Race(every=1, stop=False)
    train(steps, 0, race, **arguments)
    return [mark.figures["return"] for mark in race.marks]
