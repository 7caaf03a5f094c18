"""Beside the classifier on the board: joint angles, event output, the map of touch,
systemd."""
