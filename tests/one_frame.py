"""The way of one frame: the functions that a frame passes from the wire to a decision.

`python -m tests.one_frame > docs/one-frame.md` renews the page from a trace.
"""

import sys
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from pathlib import Path

from edge import demo
from edge.classifier import Classifier
from edge.events import Decided
from edge.fake.player import play, skin_file
from edge.model.model import Model
from edge.recording import load
from edge.skin.loop import Loop

ROOT = Path(__file__).parents[1]
EDGE = str(ROOT / "edge")
HEAD = """# The way of one frame

The functions that a frame passes from the wire to a decision, file by file, in the order
in which they are first called; those without a docstring are details of their neighbours.
The page is made from a trace of a touch on Cody's skin, at the frame that decides
(`python -m tests.one_frame`), and a test compares it with the code. The models of the
chips on the fake bus are left out; on a robot `edge/bus/linux.py` stands in their place.
A deciding frame visits {files} files. A frame in contact that decides nothing visits
{contact}: it asks neither for features nor for a decision.
"""


@dataclass(frozen=True)
class Step:
    """A function that a frame passes.

    Attributes:
        path: of its file, below the checkout.
        name: with its class.
    """

    path: str
    name: str


def _step(code):
    """The function of a code object, if it belongs to the program and has a name."""
    inside = code.co_filename.startswith(EDGE)
    if not inside or "/fake/" in code.co_filename or "<" in code.co_qualname:
        return None
    path = Path(code.co_filename).relative_to(ROOT).as_posix()
    return Step(path, code.co_qualname)


def traced(work):
    """What a call returns, and the functions that it passes, in order of first call."""
    steps = {}

    def note(frame, event, _):
        step = _step(frame.f_code) if event == "call" else None
        if step is not None:
            steps.setdefault(step)

    sys.setprofile(note)
    try:
        result = work()
    finally:
        sys.setprofile(None)
    return result, list(steps)


def ways():
    """The way of a frame in contact, and of the one that decides."""
    recording = load(demo.FOLDER / "cardboard-box-movable.npz")
    skin, playback = play(skin_file(recording.layout), recording)
    # The buses are read in this thread, one after another, so that a trace sees it.
    skin._threads.map = map
    classifier = Classifier(Model(demo.MODEL), skin.layout)
    traces = {}
    with skin:
        frames = Loop(skin, joints=playback, lasts_s=playback.ends).frames()

        def step():
            frame = next(frames, None)
            return None if frame is None else classifier.push(frame)

        while "decision" not in traces:
            in_contact = bool(classifier._pending)
            events, steps = traced(step)
            if events is None:
                raise RuntimeError("the recording is over before a decision")
            if any(isinstance(event, Decided) for event in events):
                traces["decision"] = steps
            elif in_contact:
                traces["contact"] = steps
        frames.close()
    return traces


def _summary(step):
    """The first line of a function's docstring; "" without one."""
    module = import_module(step.path.removesuffix(".py").replace("/", "."))
    return (attrgetter(step.name)(module).__doc__ or "").partition("\n")[0]


def files(steps):
    """The files that a frame visits, in order."""
    return list(dict.fromkeys(step.path for step in steps))


def page():
    """The page as Markdown."""
    traces = ways()
    decision = traces["decision"]
    contact = files(traces["contact"])
    visited = files(decision)
    lines = [HEAD.format(files=len(visited), contact=len(contact))]
    for path in visited:
        lines.append(f"**`{path}`**\n")
        for step in decision:
            # What has no docstring is a detail of what stands before it.
            if step.path == path and (text := _summary(step)):
                lines.append(f"- `{step.name}`: {text}")
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    sys.stdout.write(page())
