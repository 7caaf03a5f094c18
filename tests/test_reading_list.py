"""The core: what a real run on Cody's skin loads, and what it leaves out."""

import pytest

from edge import demo
from edge.wire.skin import file as skinfile
from tests import reading_list
from tests.conftest import ROOT
from tests.edge.wire.bus.shim import build as shim

OPTIONAL = (
    "edge/wire/bus/serial_bus.py",
    "edge/wire/chips/mpr121.py",
    "edge/decide/early.py",
    "edge/decide/knn.py",
    "edge/app/sinks/web.py",
)
"""Modules that neither this skin, nor the demo's model, nor an option calls for."""


@pytest.fixture(scope="module")
def core(tmp_path_factory):
    """Paths of the modules that a run loads over a stand-in for /dev/i2c-N."""
    if shim.compiler() is None:
        pytest.skip("needs Linux and a C compiler to stand in for /dev/i2c-N")
    folder = tmp_path_factory.mktemp("core")
    skin = folder / "skin.toml"
    text = skinfile.shipped("cody").read_text()
    rest = "[" + ", ".join(["20946"] * 24) + "],\n"
    noise = "[" + ", ".join(["0.7"] * 24) + "],\n"
    calibration = f"baseline = [\n{rest * 16}]\nnoise = [\n{noise * 16}]\n"
    skin.write_text(f"{text}\n[calibration]\n{calibration}")
    arguments = ["run", "--model", str(demo.MODEL), "--skin", str(skin)]
    arguments += ["--seconds", "0.3", "--without-joints", "skin"]
    environment = shim.environment(shim.build(folder))
    return [
        path.as_posix()
        for path in reading_list.loaded(*arguments, environment=environment)
    ]


def test_a_run_reads_the_skin_and_decides_with_a_model_without_tools_and_fakes(core):
    modules = {"edge/wire/bus/linux.py", "edge/wire/chips/ad7147.py"}
    assert modules | {"edge/decide/engines.py"} <= set(core)
    beside = ("edge/wire/fake/", "edge/app/sinks/page")
    assert not any(path.startswith(beside) for path in core)


@pytest.mark.parametrize("path", OPTIONAL)
def test_what_nothing_calls_for_is_not_loaded(core, path):
    assert (ROOT / path).exists()
    assert path not in core


def test_the_list_names_a_module_a_line(capsys):
    reading_list.main()
    assert "edge/wire/skin/bus_reader.py" in capsys.readouterr().out.splitlines()
