"""Recordings of touches, and the table of their labels."""
