"""Sections, figures and scores that the reports are built from."""
