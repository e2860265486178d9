"""Speed benchmark: this project and its peers on the same arm and machine."""
