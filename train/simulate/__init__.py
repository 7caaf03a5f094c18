"""Scenes to recordings: only the effects that a scene calls for are loaded and run."""
