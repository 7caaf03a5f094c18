"""The paper's study on any data set, ours beside the paper's."""
