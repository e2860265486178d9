"""The bound, by optimal control."""
