"""Plays controllers and says what it cost."""
