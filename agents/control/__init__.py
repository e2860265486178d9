"""Controllers: the paper's PD, classical ones, LQR; and the inverse dynamics under them."""
