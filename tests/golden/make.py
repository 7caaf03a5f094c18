"""`make golden`: the committed model and its golden outputs, from the demo scene.

Run it when the path, the graph or the format changes on purpose, and say so in the
commit: the test beside it exists to notice when they change otherwise. The bytes depend
on the versions of the packages, which the model names, but not on whether numpy and
OpenBLAS find AVX-512.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from export import golden
from export.__main__ import main as export
from train.__main__ import main as train

HERE = Path(__file__).parent
SCENE = HERE.parents[1] / "train" / "scenes" / "demo.toml"


def make(out: Path) -> None:
    """Write model.onnx and golden.npz: small, with ties (k = 6) and three tasks."""
    golden.TRIALS = 5
    golden.VECTORS = 40
    with TemporaryDirectory() as folder:
        train(["simulate", str(SCENE), "--trials", "3", "--out", folder])
        fixed = ["--features", "paper", "contact", "--projection", "lda", "--k", "6"]
        fixed += ["--decision-points", "none"]
        fixed += ["--tasks", "category", "mobility", "object", "--name", "golden"]
        export(["--data", folder, "--out", str(out), "--jobs", "1", *fixed])


if __name__ == "__main__":
    make(HERE)
