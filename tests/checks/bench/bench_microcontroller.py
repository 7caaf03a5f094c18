"""A decision on an emulated Cortex-M4F, beside emlearn's forest and k-NN in C.

All learn from the paper's features of the same simulated trials, and decide on others:
ours by the paper's k-NN. Flash and RAM are bytes of the whole program, less those of one
that decides nothing.
"""

import subprocess
from pathlib import Path

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.neighbors import KNeighborsClassifier
from sklearn.preprocessing import MinMaxScaler

from export import c_code
from tests.checks.bench import tables
from tests.checks.hard_cases.models import Ours
from tests.export.microcontroller import machine
from tests.export.test_c_code import needs_qemu
from train.data.dataset import load_trials
from train.model.pipeline import Choice
from train.simulate import run, scene

with np.errstate():  # to import it makes numpy raise errors
    import emlearn

HERE = Path(__file__).parent / "microcontroller"
GCC = "-std=c99 -Os -ffp-contract=off -ffunction-sections -fdata-sections -Wl,--gc-sections"
STEPS = 2900
"""Of the range of a feature: with more, squared distances over 120 features reach 2^30,
where emlearn's k-NN never ends."""
RIVALS = {
    "forest": RandomForestClassifier(100, random_state=0),
    "neighbours": KNeighborsClassifier(2, algorithm="brute"),
}


def trials(folder, seed, count):
    """Simulated trials, and their features."""
    file = tables.SCENES / "cody18.toml"
    run.write(scene.load(file, seed=seed, count=count), folder)
    dataset = load_trials([folder])
    return dataset, dataset.features(1.2, 40)


def answered(folder, model, vectors):
    """The labels of vectors in C; its flash, RAM and instructions of a decision."""
    gcc, qemu = machine.tools("M4F")
    program = folder / "program"
    folders = [f"-I{folder}", f"-I{Path(emlearn.__file__).parent}"]
    words = [*GCC.split(), *folders, f'-DMODEL="{HERE / model}.h"', HERE / "answer.c"]
    subprocess.run([*gcc, *words, "-o", program], check=True)
    sizes = subprocess.check_output(["arm-none-eabi-size", program]).split()
    code, data, zeros = map(int, sizes[6:9])
    command = [*qemu, program, "-icount", "shift=0"]
    *labels, instructions = machine.ask(command, folder, [vectors.tobytes()])
    return labels, [code + data, data + zeros, instructions / len(vectors)]


@needs_qemu
def bench_microcontroller(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # emlearn compiles there
    known, X = trials(tmp_path / "known", 2012, 5)
    others, Z = trials(tmp_path / "others", 7201, 12)
    scaler = MinMaxScaler((0, STEPS), clip=True).fit(X)
    whole, asked = (scaler.transform(part).astype(np.int16) for part in (X, Z))
    _, nothing = answered(tmp_path, "nothing", asked)
    rows = []
    for task in ("category", "object"):
        names, y = np.unique(known.labels(task), return_inverse=True)
        ours = Ours(X, known.labels(task), Choice("IV", 20, 2)).model
        c_code.export(ours, tmp_path)
        answers = {"ours": (Z, ours.run(Z)["t_label"])}
        for model, estimator in RIVALS.items():
            converted = emlearn.convert(estimator.fit(whole, y))
            converted.save(model, tmp_path / f"{model}_model.h")
            answers[model] = asked, estimator.predict(asked)
        for model, (vectors, of_python) in answers.items():
            labels, sizes = answered(tmp_path, model, vectors)
            right = names[np.array(labels, int)] == others.labels(task)
            numbers = np.subtract(sizes, nothing).astype(int)
            row = {"task": task, "model": model}
            row |= zip(("flash", "RAM", "instructions"), numbers, strict=True)
            row["as in Python"] = f"{np.mean(labels == of_python):.1%}"
            row["right"] = f"{right.mean():.1%}"
            rows.append(row)
    tables.write("microcontroller", [rows], "make bench")
