"""What simulation costs."""
