"""From a frame to what was measured on a contact: regions, contacts over time, features."""
