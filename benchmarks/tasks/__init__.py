"""Evaluation tasks of `ElbowArmTasks-v0`: their optima, and how far from them every player stays."""
