"""`python -m tests.fuzz`: every reader of a file under thousands of hostile files.

Each ends in an answer or in one sentence, within five seconds and 200 MB. Inputs are drawn by
reader and number alone: the same in every run. An input that does otherwise is kept under `--out`.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, Queue

from tqdm import tqdm

from edge.errors import EdgeError
from tests.fuzz.readers import READERS, ROOT, Reader, hostile

NUMBERS = re.compile(r"\b(?<!\.py:)(0x)?\d+\b")
"""In a sentence they tell inputs apart, not faults; a line of code keeps its own."""
SECONDS = 5.0
MEGABYTES = 200.0
STUCK_S = 180.0
"""Without a sign for so long a reader hangs, however busy the machine is."""


def judged(reader: Reader, path: Path) -> str:
    """Read a file; what is wrong with how it ended, or nothing."""
    from tests.fuzz.readers import Wrong, fit

    try:
        reader.read(path)
    except EdgeError as error:
        if "\n" in str(error):
            return "a sentence of several lines"
        try:
            fit(str(error))
        except Wrong as wrong:
            return str(wrong)
    except Wrong as wrong:
        return str(wrong)
    except SystemExit as error:
        return f"SystemExit {error.code}"
    except BaseException as error:
        trace, last = error.__traceback__, ""
        while trace is not None:
            file = Path(trace.tb_frame.f_code.co_filename)
            if file.is_relative_to(ROOT) and "fuzz" not in file.parts:
                last = f" at {file.relative_to(ROOT)}:{trace.tb_lineno}"
            trace = trace.tb_next
        return f"{type(error).__name__}: {str(error)[:160]}{last}"
    return ""


def memory(key: str) -> float:
    """A figure of /proc/self/status in megabytes."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{key}:"):
            return int(line.split()[1]) / 1024.0
    return 0.0


def worker(reader: Reader, first: int, count: int, folder: Path) -> None:
    """Read inputs one after another; a line of JSON each on stdout."""
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    seeds = reader.seeds()
    path = folder / f"input{reader.suffix}"
    reader.more(path)
    for data in seeds:  # what is loaded once counts for none of the inputs
        path.write_bytes(data)
        judged(reader, path)
    for number in range(first, first + count):
        path.write_bytes(hostile(reader, number, seeds))
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        began = time.process_time()
        wrong = judged(reader, path)
        seconds = time.process_time() - began
        peak = memory("VmHWM")
        if seconds > SECONDS:
            wrong = wrong or f"took {seconds:.1f} s"
        if peak > MEGABYTES:
            wrong = wrong or f"took {peak:.0f} MB"
        out.write(json.dumps([number, wrong, seconds, peak]) + "\n")


@dataclass
class Outcome:
    """What came of a reader's inputs: how many, the worst of them, and what went wrong."""

    reader: Reader
    tried: int = 0
    seconds: float = 0.0
    megabytes: float = 0.0
    wrong: dict[str, list[int]] = field(default_factory=dict)

    def add(self, number: int, wrong: str, seconds: float, peak: float) -> None:
        """Take in one input's outcome."""
        self.tried += 1
        self.seconds, self.megabytes = max(self.seconds, seconds), max(self.megabytes, peak)
        if wrong:
            self.wrong.setdefault(NUMBERS.sub("N", wrong), []).append(number)


def run(reader: Reader, count: int, progress: tqdm) -> Outcome:  # type: ignore[type-arg]
    """All inputs of a reader, in processes that may die."""
    outcome, done = Outcome(reader), 0
    while done < count:
        with tempfile.TemporaryDirectory() as folder:
            words = ["--worker", reader.name, str(done), str(count - done), folder]
            process = subprocess.Popen(
                [sys.executable, "-m", "tests.fuzz", *words],
                cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            lines: Queue[str] = Queue()

            def listen(process: subprocess.Popen[str] = process, lines: Queue[str] = lines) -> None:
                assert process.stdout is not None
                for line in process.stdout:
                    lines.put(line)
                lines.put("")

            threading.Thread(target=listen, daemon=True).start()
            why = "the process died"
            while done < count:
                try:
                    line = lines.get(timeout=STUCK_S)
                except Empty:
                    why = f"hangs: no sign for {STUCK_S:g} s"
                    break
                if not line:
                    break
                outcome.add(*json.loads(line))
                done += 1
                progress.update()
            process.kill()
            assert process.stderr is not None
            said = process.stderr.read()
            process.wait()
            if done < count:
                outcome.add(done, f"{why} {said.strip()[-200:]!r}", 0.0, 0.0)
                done += 1
                progress.update()
    return outcome


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line a reader; 1 where one ended otherwise than it should."""
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=5000, help="inputs a reader")
    parser.add_argument("--only", default="", help="readers whose name holds this text")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument("--worker", nargs=4, help=argparse.SUPPRESS)
    arguments = parser.parse_args(argv)
    by_name = {reader.name: reader for reader in READERS}
    if arguments.worker:
        name, first, count, folder = arguments.worker
        worker(by_name[name], int(first), int(count), Path(folder))
        return 0
    chosen = [reader for name, reader in by_name.items() if arguments.only in name]
    wrong = 0
    with (
        tqdm(total=arguments.count * len(chosen), unit="file") as progress,
        ThreadPoolExecutor(arguments.jobs) as pool,
    ):
        for outcome in pool.map(lambda r: run(r, arguments.count, progress), chosen):
            reader = outcome.reader
            tqdm.write(
                f"{reader.name:<12} {outcome.tried:>6} files  worst {outcome.seconds:5.2f} s "
                f"{outcome.megabytes:4.0f} MB  {sum(map(len, outcome.wrong.values()))} wrong"
            )
            seeds = reader.seeds() if outcome.wrong else []
            for what, numbers in sorted(outcome.wrong.items(), key=lambda pair: -len(pair[1])):
                wrong += len(numbers)
                kept = arguments.out / f"{reader.name}-{numbers[0]}{reader.suffix}"
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(hostile(reader, numbers[0], seeds))
                tqdm.write(f"    {len(numbers):>5} x {what}  ({kept})")
    print(f"{arguments.count * len(chosen)} files, {wrong} ended otherwise than they should")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
