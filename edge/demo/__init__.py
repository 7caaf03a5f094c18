"""What `edge-classify demo` shows: a small model, and touches that it was not fitted
on.

Model and recordings are simulated (`make demo-data`).
"""

from pathlib import Path

FOLDER = Path(__file__).parent
MODEL = FOLDER / "model.onnx"


def recordings() -> list[Path]:
    """The touches, one file each."""
    return sorted(FOLDER.glob("*.npz"))
