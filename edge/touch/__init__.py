"""From a frame to a contact that is followed: regions, the arm, contacts over time."""
