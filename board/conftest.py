"""The fixtures of tests/ that the checks of the board share."""

import importlib.util
from pathlib import Path

_spec = importlib.util.spec_from_file_location(
    "shared_fixtures", Path(__file__).resolve().parents[1] / "tests" / "conftest.py"
)
_shared = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_shared)

recordings = _shared.recordings
exported = _shared.exported
