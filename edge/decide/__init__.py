"""The exported model: loading, deciding, and checking it."""
