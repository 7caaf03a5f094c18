"""`make kills`: the commands that write files are killed 60 times each.

Each run is killed at a moment that a seed draws: at any time of a whole run, or shortly
after a file of its folder changed. Then every file must be whole, and the next start of
the same command must finish or name what was interrupted, and leave no temporary file.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnx

from edge import demo
from edge.record.recording import load
from edge.record.saving import find, listed, save
from edge.wire.fake.touches import still
from edge.wire.skin import file as skinfile
from edge.writing import PREFIX
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.conftest import ended, sealed
from train.progress import bar

EDGE = (sys.executable, "-m", "edge")
TRAIN = (sys.executable, "-m", "train")
EXPORT = (sys.executable, "-m", "export", "--quick", "--decision-points", "none")
GOLDEN = Path(__file__).parents[1] / "golden"
PATIENCE_S = 120.0
MOST_CHANGES = 4
COPIES = 12
CLOSE_S = 0.003
"""Every other kill comes at most so long after one of the first changes of a file."""
OTHER_MODEL = "is of another model"
ROBOT = "robot.onnx"


@dataclass(frozen=True)
class Victim:
    """A command that is killed.

    Attributes:
        prepare: makes the folder's files before a run.
        command: given the folder.
        finished: what is wrong with the folder after the next run, "" if nothing; it
            is given what that run printed.
        refuses: that run may say that there is nothing left to do.
    """

    prepare: Callable[[Path], None]
    command: Callable[[Path], Sequence[object]]
    finished: Callable[[Path, str], str]
    refuses: bool = False


def damage(folder):
    """What is wrong with a folder after a kill; "" if nothing.

    Raises:
        EdgeError: a recording or a table of labels is damaged.
    """
    recordings = [p for p in folder.glob("**/*.npz") if not p.name.startswith("golden")]
    labels = [load(path).labels.get("object") for path in recordings]
    if 0 < labels.count("crate") < COPIES:
        return f"{labels.count('crate')} of {COPIES} have the new label"
    if (folder / ROBOT).exists():
        return proven(folder, "")
    complaint = agreeing(folder, "") if (folder / "model.onnx").exists() else ""
    return "" if OTHER_MODEL in complaint else complaint


def copied(folder):
    """Fill a folder with the recordings of the demo, over and over."""
    recordings = demo.recordings()
    for i in range(COPIES):
        source = recordings[i % len(recordings)]
        shutil.copy(source, folder / f"{source.stem}-{i:02d}.npz")


def recorded(folder):
    fake = demo.recordings()[0]
    words = ["--loop", "--trials", 5, "--label", "object=box", "--out", folder / "out"]
    return [*EDGE, "record", "--fake", fake, *words]


def all_recorded(folder, printed):
    count = len(find([folder / "out"]))
    return "" if 5 <= count <= 10 else f"{count} recordings instead of 5 to 10"


def relabelled(folder):
    return [*EDGE, "label", "--set", "object=crate", "--yes", folder]


def leaving_out(folder):
    return [*EDGE, "label", "--leave-out", "--yes", folder]


def undoing(folder):
    return [*EDGE, "label", "--undo", folder]


def changed(folder):
    """How many recordings have the new label."""
    return sum(load(path).labels["object"] == "crate" for path in listed([folder]))


def all_changed(folder, printed):
    """The next start has changed the labels of all."""
    return "" if changed(folder) == COPIES else f"{changed(folder)} files changed"


def all_left_out(folder, printed):
    text = (folder / "labels.csv").read_text()
    return "" if text.count(",yes\n") == COPIES else text


def agreeing(folder, printed):
    """The model and its golden file belong together."""
    files = ("--model", folder / "model.onnx", "--golden", folder / "golden.npz")
    result = ended(*EDGE, "verify", *files, timeout=PATIENCE_S)
    return f"{result.stdout}{result.stderr}" if result.returncode else ""


def before_exporting(folder):
    (folder / "touches").mkdir()
    copied(folder / "touches")
    for name in ("model.onnx", "golden.npz"):
        shutil.copy(GOLDEN / name, folder / name)


def exporting(folder):
    words = ["--features", "paper", "--projection", "pca", "--components", 4, "-k", 1]
    return [*EXPORT, "--data", folder / "touches", "--out", folder, "--jobs", 1, *words]


def before_undo(folder):
    copied(folder)
    ended(*relabelled(folder))


def taken_back(folder, printed):
    """The change has been taken back, by this start or the next: no file has it."""
    return f"{changed(folder)} files changed" if changed(folder) else ""


def installing(folder):
    new = ("--golden", GOLDEN / "golden.npz", "--to", folder / ROBOT)
    return [*EDGE, "install", folder / "new.onnx", *new]


def returning(folder):
    return [*EDGE, "install", "--back", "--to", folder / ROBOT]


def before_install(folder):
    """A robot runs a model, and another one is at hand."""
    model = onnx.load(GOLDEN / "model.onnx")
    for name in ("former", "new"):
        model.doc_string = name
        (folder / "new.onnx").write_bytes(sealed(model))
        if name == "former":
            ended(*installing(folder))


def before_return(folder):
    before_install(folder)
    ended(*installing(folder))


def proven(folder, printed):
    """The model that runs has its golden file beside it, and the next run kept both."""
    result = ended(*EDGE, "verify", "--model", folder / ROBOT, timeout=PATIENCE_S)
    if result.returncode or not printed:
        return result.stderr if result.returncode else ""
    models = {path.read_bytes() for path in folder.glob(f"{ROBOT}*")}
    return "" if len(models) == 2 else f"{len(models)} models of 2 are there"


def before_calibration(folder):
    skin = shutil.copy(skinfile.shipped("cody"), folder / "skin.toml")
    save(folder / "still.npz", still(skinfile.load(skin), 1.0))


def calibrating(folder):
    skin = ("--skin", folder / "skin.toml", "--fake", folder / "still.npz")
    return [*EDGE, "calibrate", *skin, "--frames", 20, "--yes"]


def calibrated(folder, printed):
    skins = [skinfile.load(path) for path in folder.glob("skin.toml*")]
    return "" if len(skins) == 2 and skins[0].calibration else "not calibrated"


def before_import(folder):
    (folder / "in").mkdir()
    for path in demo.recordings():
        touch = load(path)
        np.save(
            folder / "in" / f"{path.stem}.npy", touch.frames.reshape(len(touch.t), -1)
        )


def importing(folder):
    words = ["--rate", 100, "--shape", "16x24", "--axis", 1, "--strict"]
    return [*TRAIN, "import", "csv", folder / "in", "--out", folder / "out", *words]


def imported(folder, printed):
    count = len(find([folder / "out"]))
    return "" if count == len(demo.recordings()) else f"{count} recordings"


VICTIMS = {
    "record": Victim(lambda folder: None, recorded, all_recorded),
    "label --set": Victim(copied, relabelled, all_changed),
    "label --leave-out": Victim(copied, leaving_out, all_left_out),
    "label --undo": Victim(before_undo, undoing, taken_back, refuses=True),
    "install": Victim(before_install, installing, proven),
    "install --back": Victim(before_return, returning, proven),
    "calibrate": Victim(before_calibration, calibrating, calibrated),
    "import": Victim(before_import, importing, imported),
    "export": Victim(before_exporting, exporting, agreeing),
}


def listing(folder):
    """When each file of a folder changed."""
    times = {}
    for path in folder.glob("**/*"):
        try:
            times[str(path)] = path.stat().st_mtime_ns
        except FileNotFoundError:  # it was a temporary file
            continue
    return times


def killed(command, folder, most_changes, delay_s):
    """Start a command, kill it, and say whether it was still alive.

    Args:
        command: the words.
        folder: whose files it changes.
        most_changes: of the folder's files that it may make before; 0 for none to wait
            for.
        delay_s: seconds after these, or after the start, until it is killed.
    """
    process = subprocess.Popen(
        list(map(str, command)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    before = listing(folder)
    changes = 0
    while changes < most_changes and process.poll() is None:
        latest = listing(folder)
        changes += latest != before
        before = latest
    try:
        process.wait(delay_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True
    return False


def temporaries(folder):
    """Temporary files, made old enough for the next start to remove them."""
    old = time.time() - 60.0
    paths = list(folder.glob(f"**/{PREFIX}*"))
    for path in paths:
        os.utime(path, (old, old))
    return paths


@dataclass(frozen=True)
class Death:
    """What came of a victim that was to be killed.

    Attributes:
        alive: whether it was killed before its end.
        left: whether it left a temporary file.
        complaint: what is wrong; "" if nothing.
    """

    alive: bool
    left: bool
    complaint: str


def killed_once(victim, most_changes, delay_s):
    """Kill a victim once."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        victim.prepare(folder)
        command = victim.command(folder)
        alive = killed(command, folder, most_changes, delay_s)
        left = temporaries(folder)
        complaint = damage(folder)
        second_run = ended(*command, timeout=PATIENCE_S)
        if second_run.returncode and not victim.refuses:
            complaint += second_run.stderr
        complaint += victim.finished(folder, second_run.stderr)
        remaining = [path for path in left if path.exists()]
        if remaining:
            complaint += f"temporary files stay: {remaining}"
        return Death(alive, bool(left), complaint)


def whole_s(victim):
    """Seconds of a whole run, which must succeed."""
    with tempfile.TemporaryDirectory() as folder:
        victim.prepare(Path(folder))
        began = time.perf_counter()
        result = ended(*victim.command(Path(folder)), timeout=PATIENCE_S)
        assert result.returncode == 0, result.stderr
        return time.perf_counter() - began


def deaths_of(name, victim, count):
    """Kill a victim at so many moments, those of odd number shortly after a change."""
    lasts_s = whole_s(victim)
    stream = random.Random(f"kills {name}")
    for i in bar(range(count), desc=name):
        changes = stream.randint(1, MOST_CHANGES) if i % 2 else 0
        delay_s = stream.uniform(0.0, CLOSE_S if changes else lasts_s)
        yield killed_once(victim, changes, delay_s)


def measure(count, only):
    """Kill, and write the table; 1 if a file was damaged or a next start failed."""
    rows = []
    complaints = []
    for name, victim in VICTIMS.items():
        if only not in name:
            continue
        deaths = list(deaths_of(name, victim, count))
        wrong = [death.complaint for death in deaths if death.complaint]
        complaints += [f"{name}: {text}" for text in wrong]
        rows.append(
            {
                "command": f"`{name}`",
                "runs": count,
                "killed before their end": sum(death.alive for death in deaths),
                "left a temporary file": sum(death.left for death in deaths),
                "damage, or a next start that failed": len(wrong),
            }
        )
    for text in complaints:
        print(text, file=sys.stderr)
    tables.write("kills", [rows])
    return 1 if complaints else 0


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--count", 60, "kills of each command"),
        ("--only", "", "commands whose names contain this"),
    )
