"""`python -m tests.checks NAME`: a program that measures, or a thorough test.

`make NAME` runs it with what it needs installed. Options after the name are those of its
last step; `--help` shows them.
"""

import argparse
import ctypes
import os
import signal
import subprocess
import sys
from dataclasses import dataclass

PYTHON = sys.executable
PR_SET_PDEATHSIG = 1
PYTEST = (PYTHON, "-m", "pytest", "-n", "2", "--dist", "loadfile")
BUSY = (*PYTEST, "-m", "not slow")
RUNTIMES = ("1.22.1", "1.26.0", "1.32.0")


def module(name, *words):
    """The command of a module."""
    return (PYTHON, "-m", name, *words)


def exported(scene, out, name):
    """Simulate a scene and export a model of its trials."""
    data = f"{out}/{scene}"
    return [
        module("train", "simulate", f"train/scenes/{scene}.toml", "--out", data),
        module("export", "--data", data, "--out", f"{out}/{name}"),
    ]


def shifts(out, data):
    """Touches unlike the training: what they do to answers, and whether doubt tells it."""
    model = f"{out}/shifts/model.onnx"
    scored = module("tests.checks.bench.shifts", "--model", model)
    return [*exported("cody18", out, "shifts"), scored]


def transfer(out, data):
    """A model of `household` on trials from another engine (MuJoCo)."""
    model = f"{out}/household-model/model.onnx"
    scored = module("tests.checks.bench.transfer", "--model", model)
    return [*exported("household", out, "household-model"), scored]


def hard_cases(out, data):
    """The cost of each hard numerical case to us and to the usual tools, with the answers
    of other ONNX Runtimes, each in an environment of its own."""
    with open("constraints.txt", encoding="utf-8") as lines:
        pins = [s.strip() for s in lines if s.startswith(("numpy==", "smbus2=="))]
    golden = f"{out}/hard-cases/golden"
    steps = [module("tests.checks.hard_cases.golden", "--out", golden)]
    for runtime in RUNTIMES:
        folder = f"{out}/hard-cases/onnxruntime-{runtime}"
        python = f"{folder}/bin/python"
        packages = (*pins, f"onnxruntime=={runtime}")
        steps += [
            module("venv", folder),
            (python, "-m", "pip", "install", "--quiet", *packages),
            module(
                "tests.checks.hard_cases.elsewhere",
                "--golden",
                golden,
                "--python",
                python,
            ),
        ]
    return [*steps, module("tests.checks.hard_cases")]


def remount(out, data):
    """The grasps of a real hand after it was taken off and put on; --data names their
    imported folders."""
    return [module("tests.checks.remount", "--recordings", *data)]


def accuracy(out, data):
    """The accuracies that export prints, of simulated and real sets, and of peers."""
    peers = f"{out}/peers/bin/python"
    return [(peers, "-m", "tests.checks.bench.accuracy")]


@dataclass(frozen=True)
class Program:
    """A program of one step: its command and what a person gets."""

    command: tuple[str, ...]
    help: str

    def __call__(self, out, data):
        """The one step."""
        return [self.command]


CHECKS = {
    "accuracy": accuracy,
    "faults": Program(
        module("tests.checks.faults"),
        "The cost of each fault on the skin's wires, as a table.",
    ),
    "flags": Program(
        module("tests.checks.bench.flags"),
        "Whether answers with a flag are more often wrong.",
    ),
    "fuzz": Program(
        (*PYTEST, "tests/checks/fuzz", "-v"),
        "5,000 damaged files for each reader: no crash, no traceback, small memory.",
    ),
    "hard-cases": hard_cases,
    "kills": Program(
        module("tests.checks.kills"),
        "Each command that writes files is killed 60 times: none is damaged.",
    ),
    "mutants": Program(
        module("tests.checks.mutants"),
        "Random words of the skin, labels, page and C are exchanged: is it noticed?",
    ),
    "remount": remount,
    "risk": Program(
        module("tests.checks.bench.risk"),
        "How often certified errors, mean times and FRONT's intervals are not kept.",
    ),
    "scale": Program(
        module("tests.checks.bench.scale"),
        "Processor time, memory and size of the model by the number of recordings.",
    ),
    "shifts": shifts,
    "soak": Program(
        module("tests.checks.bench.soak"),
        "Ten minutes of the loop in virtual time, and load on its page.",
    ),
    "test-busy": Program(
        module("tests.checks.busy", *BUSY),
        "The fast tests five times beside eight busy processes.",
    ),
    "transfer": transfer,
}
ENVIRONMENT = {"fuzz": {"FUZZ_FILES": "5000"}}


def help_of(check):
    """The sentence that says what a check is for."""
    text = check.help if isinstance(check, Program) else check.__doc__
    return " ".join(text.split())


def listing():
    """Every check with its sentence."""
    return "\n".join(f"  {name:<12} {help_of(CHECKS[name])}" for name in CHECKS)


def end_with_parent():
    """Let Linux end this process when its parent has ended, by whatever signal."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def main(words=None):
    """Run the steps of a check; the status of the first that fails."""
    parser = argparse.ArgumentParser(
        description=f"{__doc__}\n{listing()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", default="build", help="folder of what is written")
    parser.add_argument("--data", nargs="+", default=[], help="folders of recordings")
    parser.add_argument("name", choices=CHECKS, metavar="NAME")
    parser.add_argument("options", nargs=argparse.REMAINDER)
    arguments = parser.parse_args(words)
    steps = CHECKS[arguments.name](arguments.out, arguments.data)
    steps[-1] = (*steps[-1], *arguments.options)
    environment = os.environ | ENVIRONMENT.get(arguments.name, {})
    for step in steps:
        status = subprocess.run(
            step, env=environment, check=False, preexec_fn=end_with_parent
        ).returncode
        if status:
            return status
    return 0


if __name__ == "__main__":
    sys.exit(main())
