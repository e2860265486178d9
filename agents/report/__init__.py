"""One HTML file to look at: runs to replay, the paper's figures and the benchmark."""
