"""The task: circle, observation, reward, episodes."""
