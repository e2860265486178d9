"""Energy benchmark: every controller in every regime."""
