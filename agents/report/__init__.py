"""HTML page with replays of runs, the paper's figures and the benchmark."""
