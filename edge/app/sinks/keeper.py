"""Touches that `run` keeps as recordings, with their decisions, to learn from."""

import argparse
import queue
import re
import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from edge.app.output import LOG
from edge.app.review import decisions_of, is_unsure
from edge.app.sinks.sink import Event
from edge.app.source import Opened
from edge.app.trials import Segmenter, recording, shared_meta
from edge.decide.events import Decided
from edge.decide.info import ModelInfo
from edge.decide.model import Model
from edge.errors import EdgeError, InputError, counted
from edge.record.changes import CHANGES
from edge.record.labels import read_table
from edge.record.recording import read_meta
from edge.record.saving import save
from edge.touch.frame import Frame
from edge.writing import alone, check_writable

REASONS = ("unsure", "unknown", "unusual", "all")
LONGEST_S = 10.0
"""Seconds from onset that are kept of a touch."""
MOST_BYTES = 200_000_000
"""Bytes that the kept files may take together."""
WAITING = 4
"""Touches that may wait to be written; of more the oldest is lost."""
STEM = "kept-n"
"""Begins a kept file's name, before its number. The numbers, and not a clock that may go
back, tell which came first; older versions' names, `kept-` with a time, come before."""
NUMBER = re.compile(rf"{STEM}(\d+)-")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that ask for a keeper."""
    parser.add_argument(
        "--keep",
        metavar="DIR",
        type=Path,
        help="folder in which touches are kept as recordings with their decisions, to "
        "label and train on",
    )
    parser.add_argument(
        "--keep-if",
        default="unsure,unknown,unusual",
        metavar="WHY",
        help=f"reasons to keep a touch, of {', '.join(REASONS)} (default: %(default)s)",
    )


def open_sink(
    arguments: argparse.Namespace, opened: Opened, model: Model
) -> "Keeper | None":
    """The keeper that the options ask for."""
    if arguments.keep is None:
        return None
    return Keeper(arguments.keep, reasons(arguments.keep_if), opened, model.info)


class Keeper:
    """Collects touches with their decisions, and saves those that ask for it.

    Files are written by a thread, whole or not at all, so that no disk delays a
    decision. Where they would exceed the limit, those without labels go, the oldest
    first, so that in the end a new one may not stay.

    Attributes:
        written: the files of this run.
        lost: touches that came faster than they could be written.
    """

    def __init__(
        self,
        folder: Path,
        reasons: Sequence[str],
        opened: Opened,
        info: ModelInfo,
    ) -> None:
        """Keep touches of a skin in a folder.

        Args:
            folder: for the recordings; made where it is missing.
            reasons: some of `REASONS`.
            opened: the skin whose frames are pushed.
            info: of the model that decides.

        Raises:
            InputError: the folder cannot be written.
        """
        check_writable(folder)
        self.written: list[Path] = []
        self.lost = 0
        self._folder = folder
        self._reasons = frozenset(reasons)
        self._window_s = info.window_s
        self._meta = shared_meta(opened, info.chain)
        if info.chain is not None:
            self._meta["joint_names"] = list(info.chain.names)
        self._trials = Segmenter(opened.skin, LONGEST_S)
        self._complete: deque[list[Frame]] = deque()
        """The frames of touches that wait for their decisions."""
        self._decided: list[Decided] = []
        self._queue = queue.Queue[tuple[list[Frame], list[Decided]] | None](WAITING)
        self._thread = threading.Thread(target=self._write_all, daemon=True)
        self._thread.start()

    def push(self, frame: Frame, events: Sequence[Event]) -> None:
        """Take in a frame and the events that came with it."""
        self._decided += [event for event in events if isinstance(event, Decided)]
        frames = self._trials.push(frame)
        if frames is not None:
            self._complete.append(frames)
        if self._complete and frame.t - self._complete[0][-1].t >= self._window_s:
            self._hand_over(self._complete.popleft())

    def close(self) -> None:
        """Save the complete touches, and wait until all are written."""
        rest = self._trials.rest()
        if rest is not None:
            self._complete.append(rest)
        for frames in self._complete:
            self._hand_over(frames)
        self._queue.put(None)
        self._thread.join()
        if self.written or self.lost:
            count = sum(path.exists() for path in self.written)
            losses = f", {self.lost} lost" if self.lost else ""
            LOG.info(f"{self._folder}: {counted(count, 'recording')} kept{losses}")

    def _hand_over(self, frames: list[Frame]) -> None:
        first = frames[0].t
        last = frames[-1].t
        decided = [d for d in self._decided if first <= d.onset_s <= last]
        self._decided = [d for d in self._decided if d.onset_s > last]
        if not (decided and self._reasons & reasons_of(decided)):
            return
        try:
            self._queue.put_nowait((frames, decided))
        except queue.Full:
            self.lost += 1

    def _write_all(self) -> None:
        while (touch := self._queue.get()) is not None:
            try:
                self._write(*touch)
            except EdgeError as error:
                self.lost += 1
                LOG.error(f"a touch could not be kept: {error}")

    def _write(self, frames: list[Frame], decided: list[Decided]) -> None:
        now = datetime.now(UTC)
        numbers = [0]
        for file in self._folder.glob(f"{STEM}*.npz"):
            numbers += map(int, NUMBER.findall(file.name))
        # Another run may keep touches in this folder in the same second.
        name = f"{STEM}{max(numbers) + 1:06}-{now:%Y%m%dT%H%M%S-%f}"
        meta = {
            **self._meta,
            "trial": name,
            "labels": {},
            "kept": now.isoformat(timespec="seconds"),
            "decided": decisions_of(decided),
        }
        path = self._folder / f"{name}.npz"
        save(path, recording(frames, meta), lasting=False, overwrite=False)
        self.written.append(path)
        self._make_room()
        if not path.exists():
            LOG.warning(
                f"{self._folder}: touches are no longer kept, as labelled or unreadable "
                f"ones fill the {MOST_BYTES // 1_000_000} MB that kept ones may take; move "
                "them to another folder"
            )

    def _make_room(self) -> None:
        """Remove the oldest kept files without labels until the rest fits, but for those
        that cannot be removed."""
        sizes = {}
        for file in sorted(self._folder.glob("kept-*.npz")):
            with suppress(OSError):  # another program may be quicker
                sizes[file] = file.stat().st_size
        excess = sum(sizes.values()) - MOST_BYTES
        if excess <= 0:
            return
        # Who changes labels here keeps all; the next touch makes room.
        with suppress(InputError), alone(self._folder, CHANGES):
            rows = read_table(self._folder).rows
            for file, size in sizes.items():
                if excess > 0 and file.name not in rows and not is_labelled(file):
                    with suppress(OSError):
                        file.unlink()
                        excess -= size


def is_labelled(file: Path) -> bool:
    """Whether a recording was labelled; one that cannot be read may have been."""
    with suppress(InputError):
        return bool(read_meta(file)["labels"])
    return True


def reasons_of(decided: Sequence[Decided]) -> set[str]:
    """The reasons for which a touch with these decisions is worth keeping."""
    reasons = {"all"}
    for decision in decided:
        reasons.update(set(REASONS) & set(decision.flags))
        if is_unsure(decision.confidence, decision.flags):
            reasons.add("unsure")
    return reasons


def reasons(text: str) -> tuple[str, ...]:
    """The reasons in a list such as `unsure,unknown`.

    Raises:
        InputError: one of them is none.
    """
    names = tuple(text.split(","))
    if not set(REASONS).issuperset(names):
        raise InputError(
            f"--keep-if takes {', '.join(REASONS)}, separated by commas, not {text!r}"
        )
    return names
