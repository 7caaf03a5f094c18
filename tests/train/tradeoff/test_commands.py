"""Commands of the report: they name the data, the folder and the files, quoted where a
shell needs it."""

from pathlib import Path

from train.tradeoff.commands import PROGRAM, Commands

BUILD = Path("build/tradeoff")


def commands(*data, out=BUILD, **facts):
    return Commands(data, Path("a b.npz"), out, **facts)


def test_a_model_of_a_window():
    assert commands("my touches", "kept").export("--window 1") == (
        f"{PROGRAM} export --data 'my touches' kept --out build --window 1"
    )
    elsewhere = commands("mine", out=Path("elsewhere"), quick=True)
    assert elsewhere.export("--window 1") == (
        f"{PROGRAM} export --data mine --out elsewhere --quick --window 1"
    )


def test_a_point_of_the_front():
    assert commands("my touches", out=Path("a b")).front("0.9") == (
        f"{PROGRAM} export --data 'my touches' --out 'a b' --front 0.9 "
        "--fronts 'a b/front.json'"
    )


def test_an_early_decision_on_a_recording():
    assert commands("mine").run(0.1) == (
        f"{PROGRAM} run --model build/model.onnx --error 0.1 --fake 'a b.npz'"
    )
