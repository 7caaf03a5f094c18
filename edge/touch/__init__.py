"""From a frame to the features of a contact: regions, and contacts over time."""
