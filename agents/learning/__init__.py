"""Training of policies: PPO, SAC, imitation."""
