"""Parts of the simulator."""
