"""Imitation of Newton's steps from the policy's own motions, on tasks that are drawn anew in every round."""
