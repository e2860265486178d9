"""Players, recordings of their episodes, and metrics."""
