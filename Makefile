PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= build
READY := $(VENV)/.ready
# Errors alone: every editable installation warns.
PIP := $(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt
# Matrices this small only lose by several threads, which also fight with the processes beside.
export OPENBLAS_NUM_THREADS := 1

.PHONY: help venv test lint types export demo demo-data golden study tradeoff wheel wheel-test \
  board-test hard-cases hard-cases-versions mutants fuzz bench transfer matched docs faults risk \
  stopping soak soak-day clean

help:
	@echo "make test     what CI runs: lint, types and tests"
	@echo "make export   fit a model; DATA=folder of recordings (default: the simulated set) OUT=build"
	@echo "make demo     fit a model on a small simulated set, then decide on touches it has not seen"
	@echo "make study    the paper's analyses beside ours: build/study/report.html; DATA= for yours"
	@echo "make tradeoff what accuracy costs in time: build/tradeoff/report.html; BOARD=board.json for"
	@echo "              a board's timings (edge-classify bench; default: this machine's), DATA= for yours;"
	@echo "              then make export FRONT=fast|balanced|accurate|milliseconds|accuracy"
	@echo "make wheel    what goes on the board: dist/edge_classify-*.whl"
	@echo "make wheel-test   tests the wheel in an empty environment, outside the checkout"
	@echo "make board-test   tests the wheel on an emulated aarch64 and counts its instructions"
	@echo "make demo-data    renews the model and the touches that the wheel carries"
	@echo "make bench    speed, side by side with the alternatives"
	@echo "make docs     the documentation as a site: build/site/index.html"
	@echo "make transfer a model of SCENE on trials that another engine (MuJoCo) makes: accuracies, curves"
	@echo "make matched  the same four touches in MuJoCo and in our simulator, beside theory"
	@echo "make faults   what each fault on the skin's wires costs, as a table"
	@echo "make risk     how often a certified error rate is exceeded, over 200 simulated data sets"
	@echo "make stopping   deciding when sure beside fixed windows and, where aeon is installed, TEASER"
	@echo "make hard-cases   what each hard case costs us and the usual tools, as a table"
	@echo "make hard-cases-versions   the same answers from another ONNX Runtime"
	@echo "make mutants  removes each guard in turn, and makes 200 random changes: do tests fail?"
	@echo "make fuzz     reads 5,000 hostile files of each kind: every one must end in an answer or a sentence"
	@echo "make soak     ten minutes of the loop in virtual time: memory and schedule"
	@echo "make soak-day the same for 24 hours, with decisions, map and UDP"
	@echo "make requirements-board.txt   the board's packages, pinned with hashes"

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(PIP) "pip>=25.1"
	$(PIP) -e . --group dev
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
SIMULATED := $(OUT)/$(basename $(notdir $(SCENE)))

$(SIMULATED)/.made: $(READY) $(SCENE) $(wildcard train/scenes/*.toml train/simulate/*.py train/simulate/effects/*.py)
	rm -rf $(SIMULATED)
	$(BIN)/python -m train simulate $(SCENE) --out $(SIMULATED)
	@touch $@

ifdef DATA
RECORDINGS := $(DATA)
else
RECORDINGS := $(SIMULATED)
export: $(SIMULATED)/.made
endif

# FRONT=fast, balanced, accurate, milliseconds or an accuracy: a point of `make tradeoff`.
ifdef FRONT
FRONTED := --front $(FRONT) $(addprefix --fronts ,$(wildcard $(OUT)/tradeoff/front.json))
endif

export: $(READY)
	$(BIN)/python -m export --data $(RECORDINGS) --out $(OUT) $(FRONTED) $(EXPORT)

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

# The README's pictures, and the settings of `make export FRONT=` where no trade-off was made here.
docs/tradeoff.png: tradeoff
	cp $(OUT)/tradeoff/tradeoff.png $@
	cp $(OUT)/tradeoff/front.json train/tradeoff/front.json

docs/touches.png docs/touches-dark.png: $(READY)
	$(BIN)/python -m train show edge/demo/*.npz --model edge/demo/model.onnx \
	  $(if $(findstring dark,$@),--dark) --out $@

docs/touch.png: $(READY)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(OUT)/picture --seed 2012 --trials 1
	$(BIN)/python -m train show $(OUT)/picture/cardboard-box-movable-00.npz --scene --out $@

BENCHVENV := $(VENV)/.bench

$(BENCHVENV): $(READY)
	$(PIP) --group bench
	@touch $@

bench: $(BENCHVENV)
	$(BIN)/python -m pytest bench -o python_files='bench_*.py' -o python_functions='bench_*' \
	  -o filterwarnings=default --benchmark-disable-gc --benchmark-warmup=off \
	  --benchmark-columns=median,iqr,rounds

transfer: SCENE := train/scenes/household.toml
transfer: $(BENCHVENV)
	$(BIN)/python -m train simulate $(SCENE) --out $(OUT)/transfer/simulated
	$(BIN)/python -m export --data $(OUT)/transfer/simulated --out $(OUT)/transfer $(EXPORT)
	$(BIN)/python -m bench.transfer --model $(OUT)/transfer/model.onnx --out $(OUT)/transfer \
	  --ours $(OUT)/transfer/simulated

matched: $(BENCHVENV)
	$(BIN)/python -m bench.matched

ifndef DATA
study tradeoff: $(SIMULATED)/.made
STUDIED := --scene $(SCENE)
endif

study: $(READY)
	$(BIN)/python -m train study --data $(RECORDINGS) $(STUDIED) --out $(OUT)/study $(STUDY)

# Without a BOARD, this machine's own figures: a model of these recordings, with the features that
# the report measures, benched here.
ifdef BOARD
tradeoff: $(READY)
else
BOARD := $(OUT)/tradeoff/board.json
tradeoff: $(READY)
	$(BIN)/python -m export --data $(RECORDINGS) --out $(OUT)/tradeoff --features paper contact \
	  --projection lda
	$(BIN)/edge-classify bench --model $(OUT)/tradeoff/model.onnx --out $(BOARD)
endif
	$(BIN)/python -m export.prices --data $(RECORDINGS) --out $(OUT)/tradeoff/prices.json
	$(BIN)/python -m train tradeoff --data $(RECORDINGS) $(STUDIED) --board $(BOARD) \
	  --prices $(OUT)/tradeoff/prices.json --out $(OUT)/tradeoff $(TRADEOFF)

# The site, with the reference from the docstrings; every link must lead somewhere.
$(VENV)/.docs: $(READY)
	$(PIP) --group docs
	@touch $@

docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict --site-dir $(OUT)/site

risk: $(READY)
	$(BIN)/python -m bench.risk $(RISK)

ifndef DATA
stopping: $(SIMULATED)/.made
endif

stopping: $(READY)
	$(BIN)/python -m bench.stopping --data $(RECORDINGS) $(STOPPING)

faults: $(READY)
	$(BIN)/python -m bench.faults

soak: $(READY)
	$(BIN)/python -m bench.soak

soak-day: $(READY)
	$(BIN)/python -m bench.soak --minutes 1440 --every 60

requirements-board.txt: $(READY) pyproject.toml constraints.txt
	$(BIN)/python -m board.requirements

# Stale copies of modules would go into the wheel.
wheel: $(READY)
	rm -rf build/lib build/bdist.* dist
	PIP_CONSTRAINT=$(CURDIR)/constraints.txt SOURCE_DATE_EPOCH=1577836800 \
	  $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps -w dist .

wheel-test: wheel
	$(BIN)/python -m pytest board/test_wheel.py

board-test: wheel
	$(BIN)/python -m pytest board/test_aarch64.py -rs --capture=tee-sys

DEMODATA := $(OUT)/demo-data

demo-data: $(READY)
	rm -rf $(DEMODATA)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMODATA)/known
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMODATA)/unseen --seed 2012 --trials 1
	$(BIN)/python -m export --data $(DEMODATA)/known --out $(DEMODATA) --decision-points none \
		--features paper --projection pca --tasks category mobility object
	PYTHONPATH=. $(BIN)/python board/demo_data.py $(DEMODATA)

HARD := $(OUT)/hard-cases

# With what another ONNX Runtime answers, and an aarch64 where `make board-test` has run.
hard-cases: hard-cases-versions
	$(BIN)/python -m tests.hard_cases --out $(HARD)
	$(BIN)/python -m tests.hard_cases.adversarial

# Golden files of hard cases, then asked again with another ONNX Runtime.
OTHER_RUNTIME ?= 1.22.1
OTHER := $(HARD)/onnxruntime-$(OTHER_RUNTIME)

$(OTHER)/.ready: constraints.txt
	$(PYTHON) -m venv $(OTHER)
	$(OTHER)/bin/python -m pip install --quiet --disable-pip-version-check \
	  $$(grep -E '^(numpy|smbus2)==' constraints.txt) onnxruntime==$(OTHER_RUNTIME)
	@touch $@

hard-cases-versions: $(READY) $(OTHER)/.ready
	$(BIN)/python -m tests.hard_cases.golden --out $(HARD)/golden
	$(BIN)/python -m tests.hard_cases.elsewhere --golden $(HARD)/golden $(OTHER)/bin/python

mutants: $(READY)
	$(BIN)/python -m tests.mutation.guards
	$(BIN)/python -m tests.mutation.sample

fuzz: $(READY)
	$(BIN)/python -m tests.fuzz --out $(OUT)/fuzz $(FUZZ)

clean:
	rm -rf build dist
