"""Numbers a model can eat: sound as rows, motion as columns, and both cut to the same frames (no torch)."""
