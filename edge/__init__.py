"""What the board runs: from the skin's taxels to a decision about the thing touched."""

__version__ = "0.1.0"
