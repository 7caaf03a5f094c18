"""Pictures of recordings, scenes and maps."""
