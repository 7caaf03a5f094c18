PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= build
READY := $(VENV)/.ready

.PHONY: help venv test lint types export demo demo-data golden wheel wheel-test board-test \
  hard-cases bench faults soak clean

help:
	@echo "make test     what CI runs: lint, types, tests"
	@echo "make export   DATA=folder of recordings (the simulated set without it) OUT=build"
	@echo "make demo     export, then replay: decisions on a small simulated set"
	@echo "make wheel    what goes on the board: dist/edge_classify-*.whl"
	@echo "make wheel-test   the wheel in an empty environment, away from here"
	@echo "make board-test   the wheel on an emulated aarch64: numbers, tests, instruction counts"
	@echo "make demo-data    the model and touches that the wheel carries"
	@echo "make bench    speed, side by side with the alternatives"
	@echo "make faults   what each fault on the skin's wires costs, as a table"
	@echo "make soak     ten minutes of the loop in virtual time: memory and schedule"

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .[dev]
	@touch $@

venv: $(READY)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

test: lint types
	$(BIN)/python -m pytest -n 2

# The recordings to fit: DATA, or the simulated default set.
SCENE := train/scenes/cody18.toml
SIMULATED := $(OUT)/cody18

$(SIMULATED)/.made: $(READY) $(SCENE) $(wildcard train/simulate/*.py train/simulate/effects/*.py)
	rm -rf $(SIMULATED)
	$(BIN)/python -m train simulate $(SCENE) --out $(SIMULATED)
	@touch $@

ifdef DATA
RECORDINGS := $(DATA)
else
RECORDINGS := $(SIMULATED)
export: $(SIMULATED)/.made
endif

export: $(READY)
	$(BIN)/python -m export --data $(RECORDINGS) --out $(OUT) $(EXPORT)

DEMO := $(OUT)/demo

# Contacts to learn from, contacts of another seed to decide on, the same over fake chips.
demo: $(READY)
	rm -rf $(DEMO)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMO)/known
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMO)/unseen --seed 2012 --trials 2
	$(BIN)/python -m export --data $(DEMO)/known --out $(DEMO)
	$(BIN)/edge-classify verify --model $(DEMO)/model.onnx --golden $(DEMO)/golden.npz > /dev/null
	$(BIN)/edge-classify replay --model $(DEMO)/model.onnx --summary $(DEMO)/unseen
	$(BIN)/edge-classify run --model $(DEMO)/model.onnx --fake $(DEMO)/unseen/cardboard-box-movable-00.npz

# The committed model and outputs that the tests hold the edge to.
golden: $(READY)
	$(BIN)/python -m tests.golden.make

# The README's picture.
docs/touch.png: $(READY)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(OUT)/picture --seed 2012 --trials 1
	$(BIN)/python -m train show $(OUT)/picture/cardboard-box-movable-00.npz --scene --out $@

BENCHVENV := $(VENV)/.bench

$(BENCHVENV): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .[bench]
	@touch $@

bench: $(BENCHVENV)
	$(BIN)/python -m pytest bench -o python_files='bench_*.py' -o python_functions='bench_*' \
	  -o filterwarnings=default --benchmark-disable-gc --benchmark-warmup=off \
	  --benchmark-columns=median,iqr,rounds

.PHONY: help venv test lint types export demo demo-data wheel wheel-test board-test bench faults \
  soak clean

clean:
	rm -rf build dist
