"""What motion costs."""
