"""Trains policies: PPO, SAC, imitation."""
