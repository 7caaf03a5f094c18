"""What runs around the classifier on the board: the loop, joint angles, event output, systemd."""
