"""Controllers to compare with: the paper's PD, and one learned policy for each algorithm and task."""
