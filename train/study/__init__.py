"""The paper's study on any data set: every analysis, ours beside the paper's, and
beyond it."""
