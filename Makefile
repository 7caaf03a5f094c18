PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= build
READY := $(VENV)/.ready
# Only errors: every editable installation prints a warning.
PINNED := python -m pip install -qq --disable-pip-version-check -c
PIP := $(BIN)/$(PINNED) constraints.txt
# Several threads slow down matrices as small as ours, and disturb the processes beside them.
export OPENBLAS_NUM_THREADS := 1

.PHONY: help venv test test-all test-busy lint types export demo demo-data golden study tradeoff wheel wheel-test \
  board-test browser-test c-test kernel-test peers-test service-test hard-cases hard-cases-versions mutants fuzz kills accuracy bench transfer remount docs faults flags risk shifts \
  stopping soak measured constraints clean

help:
	@echo "Everyday"
	@echo "  make test          lint, types and the fast tests"
	@echo "  make test-all      the slow tests too, as CI runs them"
	@echo "  make test-busy     the fast tests five times beside eight busy processes"
	@echo "  make export        fit a model to DATA (a folder of recordings; default: simulated ones)"
	@echo "                     and write model.onnx, golden.npz and report.html to OUT (default:"
	@echo "                     build); NAME=... names the model; C=DIR writes it in C99 too"
	@echo "  make demo          fit a model to a small simulated set and decide on touches new to it"
	@echo "  make study         the paper's analyses of DATA beside ours: build/study/report.html"
	@echo "  make tradeoff      what accuracy costs in time: build/tradeoff/report.html; BOARD=board.json"
	@echo "                     (from edge-classify bench) takes a board's timings in place of this"
	@echo "                     machine's; then make export FRONT=fast|balanced|accurate|MS|ACCURACY"
	@echo "  make docs          the documentation as a site: build/site/index.html"
	@echo "For a board"
	@echo "  make wheel         build the package that goes on the board: dist/edge_classify-*.whl"
	@echo "  make wheel-test    test the wheel in an empty environment outside the checkout"
	@echo "  make board-test    test the wheel on an emulated aarch64"
	@echo "  make c-test        the model in C beside Python, here and on Cortex-M0+, M4F and M33 (QEMU)"
	@echo "  make kernel-test   run the commands under a real Linux kernel, over modelled chips"
	@echo "  make browser-test  use the page and the report in Chromium, and look for what excludes people"
	@echo "  make peers-test    the kernels beside aeon's MiniRocket"
	@echo "  make service-test  start, hang and restart the service under a systemd of its own (root)"
	@echo "  make requirements-board.txt   pin the board's packages with hashes"
	@echo "Measurements"
	@echo "  make accuracy      the accuracies that export prints, of simulated and (GRASPS=folder) real sets, and of peers"
	@echo "  make bench         speed beside the alternatives"
	@echo "  make transfer      score a model of SCENE on trials from another engine (MuJoCo)"
	@echo "  make faults        the cost of each fault on the skin's wires, as a table"
	@echo "  make risk          how often certified errors, mean times and FRONT's intervals are not kept"
	@echo "  make shifts        what touches unlike the training do to answers, and whether doubt tells it"
	@echo "  make flags         are answers with a flag more often wrong? FLAGS=\"--recordings folders\" of a real skin"
	@echo "  make remount       grasps of a real hand (REMOUNT=\"folders\") after it was taken off and put on"
	@echo "  make stopping      deciding when sure beside fixed windows and extra trees"
	@echo "  make soak          ten minutes of the loop in virtual time, and load on its page"
	@echo "  make measured      all tables of docs/measured anew, one after another; ONLY=\"risk kills\""
	@echo "Thorough tests"
	@echo "  make hard-cases    the cost of each hard numerical case to us and to the usual tools"
	@echo "  make hard-cases-versions   the same answers from other ONNX Runtimes"
	@echo "  make mutants       make 200 random changes to the skin, labels, page and C: is each noticed?"
	@echo "  make fuzz          read 5,000 damaged files of each kind: no crash, no traceback, small memory"
	@echo "  make kills         kill each command that writes files 60 times: none is damaged"
	@echo "Upkeep"
	@echo "  make golden        renew the small model and outputs that the tests compare with"
	@echo "  make demo-data     renew the model and the touches that the wheel carries"
	@echo "  make constraints   check that constraints.txt pins exactly what the groups need"
	@echo "  make clean         remove build and dist"

# What `make demo` and `make export` need; what a target needs beyond that, it installs itself.
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(PIP) "pip>=25.1"
	$(PIP) -e . --group train
	@touch $@

DEV := $(VENV)/.dev

$(DEV): $(READY)
	$(PIP) --group dev
	@touch $@

venv: $(READY)

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(DEV)
	$(BIN)/mypy

# A file's tests share a worker, so that its fixtures are made once.
PYTEST := $(BIN)/python -m pytest -n 2 --dist loadfile

test: lint types
	$(PYTEST) -m "not slow" $(TESTS)

test-all: lint types
	$(PYTEST) $(TESTS)

test-busy: $(DEV)
	$(BIN)/python -m tests.checks.busy $(PYTEST) -m "not slow" $(TESTS)

# The recordings to fit: DATA, or the simulated default set.
SCENE := train/scenes/cody18.toml
SIMULATED := $(OUT)/$(basename $(notdir $(SCENE)))

$(SIMULATED)/.made: $(READY) $(SCENE) $(wildcard train/scenes/*.toml train/simulate/*.py train/simulate/effects/*.py)
	rm -rf $(SIMULATED)
	$(BIN)/python -m train simulate $(SCENE) --out $(SIMULATED)
	@touch $@

# What is given must be there: an empty or misspelt DATA must not train on simulated touches.
ifeq ($(origin data),command line)
$(error give DATA=$(data) in capitals)
endif
ifeq ($(origin DATA),command line)
ifeq ($(strip $(DATA)),)
$(error DATA is empty; name a folder of recordings)
endif
ifeq ($(findstring n,$(firstword -$(MAKEFLAGS))),)  # a dry run says what it would do
$(foreach part,$(DATA),$(if $(wildcard $(part)),,$(error DATA names $(part), which does not \
  exist; a name with a space is for `edge-classify export --data` alone)))
endif
endif

ifdef DATA
RECORDINGS := $(DATA)
# With a SCENE beside DATA, its touches are weighed beside the recordings.
ifneq ($(origin SCENE),file)
BESIDE := $(SIMULATED)
export: $(SIMULATED)/.made
endif
else
RECORDINGS := $(SIMULATED)
export: $(SIMULATED)/.made
endif

# FRONT=fast, balanced, accurate, milliseconds or an accuracy: a point that `make tradeoff` found.
ifdef FRONT
FRONTS := $(firstword $(wildcard $(OUT)/tradeoff/front.json build/tradeoff/front.json))
ifeq ($(FRONTS)$(findstring n,$(firstword -$(MAKEFLAGS))),)
$(error FRONT needs the points of `make tradeoff`; run make tradeoff with the same DATA and OUT first)
endif
FRONTED := --front $(FRONT) --fronts $(or $(FRONTS),$(OUT)/tradeoff/front.json)
endif

export: $(READY)
	$(BIN)/python -m export --data $(RECORDINGS) $(BESIDE) --out $(OUT) --report $(FRONTED) \
	  $(addprefix --name ,$(NAME)) $(addprefix --compare ,$(COMPARE)) $(if $(TEST),--test $(TEST)) \
	  $(addprefix --c ,$(C)) $(EXPORT)

DEMO := $(OUT)/demo

# Contacts to learn from, contacts of another seed to decide on, and one of these over fake chips.
demo: $(READY)
	rm -rf $(DEMO)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMO)/known
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMO)/unseen --seed 2012 --trials 2
	$(BIN)/python -m export --data $(DEMO)/known --out $(DEMO)
	$(BIN)/edge-classify verify --model $(DEMO)/model.onnx --golden $(DEMO)/golden.npz > /dev/null
	$(BIN)/edge-classify replay --model $(DEMO)/model.onnx --summary $(DEMO)/unseen
	$(BIN)/edge-classify run --model $(DEMO)/model.onnx --fake $(DEMO)/unseen/cardboard-box-movable-00.npz

# The committed model and outputs that the tests compare the edge with.
golden: $(DEV)
	$(BIN)/python -m tests.golden.make

# The README's pictures.
docs/tradeoff.png: tradeoff
	cp $(OUT)/tradeoff/tradeoff.png $@
	$(BIN)/python -m tests.checks.bench.tables tradeoff "make tradeoff" $(OUT)/tradeoff/answer_*.csv

# The tables of docs/measured.md that a report has measured.
docs/measured/study.md: STUDY := --seeds 8
docs/measured/study.md: study
	$(BIN)/python -m tests.checks.bench.tables study 'make study STUDY="$(STUDY)"' $(OUT)/study/headline.csv

docs/touches.png docs/touches-dark.png: $(READY)
	$(BIN)/python -m train show edge/demo/*.npz --model edge/demo/model.onnx \
	  $(if $(findstring dark,$@),--dark) --out $@

docs/touch.png: $(READY)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(OUT)/picture --seed 2012 --trials 1
	$(BIN)/python -m train show $(OUT)/picture/cardboard-box-movable-00.npz --out $@

BENCHVENV := $(VENV)/.bench

$(BENCHVENV): $(DEV)
	$(PIP) --group bench
	@touch $@

# BENCH="-k region": only the benchmarks whose names contain this.
bench: $(BENCHVENV)
	$(BIN)/python -m pytest tests/checks/bench -o python_files='bench_*.py' -o python_functions='bench_*' \
	  -o filterwarnings=default $(BENCH)

HELD := $(OUT)/transfer

transfer: SCENE := train/scenes/household.toml
transfer: $(BENCHVENV)
	$(BIN)/python -m train simulate $(SCENE) --out $(HELD)/simulated
	$(BIN)/python -m export --data $(HELD)/simulated --out $(HELD)/household $(EXPORT)
	$(BIN)/python -m tests.checks.bench.transfer --model $(HELD)/household/model.onnx $(TRANSFER)

ifndef DATA
study tradeoff: $(SIMULATED)/.made
STUDIED := --scene $(SCENE)
endif

study: $(READY)
	$(BIN)/python -m train study --data $(RECORDINGS) $(STUDIED) --out $(OUT)/study $(STUDY)

# Without a BOARD: time the quick model of these recordings on this machine.
ifdef BOARD
tradeoff: $(READY)
else
BOARD := $(OUT)/tradeoff/board.json
tradeoff: $(READY)
	$(BIN)/python -m train tradeoff --data $(RECORDINGS) --out $(OUT)/tradeoff --check
	$(BIN)/python -m export --data $(RECORDINGS) --out $(OUT)/tradeoff --quick
	$(BIN)/edge-classify bench --model $(OUT)/tradeoff/model.onnx --out $(BOARD)
endif
	$(BIN)/python -m train tradeoff --data $(RECORDINGS) --board $(BOARD) \
	  --out $(OUT)/tradeoff $(TRADEOFF)

# The site, with the Python reference from the docstrings; a broken link is an error.
$(VENV)/.docs: $(READY)
	$(PIP) --group docs
	@touch $@

docs: $(VENV)/.docs
	$(BIN)/python -m mkdocs build --quiet --strict --site-dir $(OUT)/site

risk: $(DEV)
	$(BIN)/python -m tests.checks.bench.risk $(RISK)

shifts: $(DEV) $(SIMULATED)/.made
	$(BIN)/python -m export --data $(SIMULATED) --out $(OUT)/shifts $(EXPORT)
	$(BIN)/python -m tests.checks.bench.shifts --model $(OUT)/shifts/model.onnx

flags: $(BENCHVENV)
	$(BIN)/python -m tests.checks.bench.flags $(FLAGS)

# Each folder of DATA is a data set of its own; by default five seeds of the scene, with 140
# trials each and with 560: STOPPING_TRIALS of each object in each condition.
STOPPING_TRIALS ?= 5 20
ifdef DATA
STOPPED := $(DATA)
else
STOPPED := $(foreach trials,$(STOPPING_TRIALS),$(foreach seed,2012 2013 2014 2015 2016,\
  $(OUT)/stopping/$(trials)/$(seed)))
stopping: $(addsuffix /.made,$(STOPPED))
endif

$(OUT)/stopping/%/.made: $(READY) $(SCENE)
	$(BIN)/python -m train simulate $(SCENE) --trials $(*D) --seed $(*F) --out $(@D)
	@touch $@

# An environment of its own: aeon 1.6.0 does not take the numpy and pandas that
# constraints.txt pins.
PEERS := $(OUT)/peers

$(PEERS)/.ready: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(PEERS)
	grep -v '^numpy==\|^pandas==' constraints.txt > $(PEERS)/constraints.txt
	$(PEERS)/bin/$(PINNED) $(PEERS)/constraints.txt "pip>=25.1"
	$(PEERS)/bin/$(PINNED) $(PEERS)/constraints.txt -e . --group peers
	@touch $@

accuracy: $(PEERS)/.ready
	$(PEERS)/bin/python -m tests.checks.bench.accuracy $(if $(GRASPS),--grasps "$(GRASPS)")

peers-test: $(PEERS)/.ready
	$(PEERS)/bin/python -m pytest tests/edge/features/test_kernels.py -k aeon -rs

stopping: $(DEV)
	$(BIN)/python -m tests.checks.bench.stopping --data $(STOPPED) $(STOPPING)

# REMOUNT="icub sdh2": folders of imported grasps.
remount: $(DEV)
	$(BIN)/python -m tests.checks.remount --recordings $(REMOUNT)

# FAULTS="--every 10": every tenth position.
faults: $(DEV)
	$(BIN)/python -m tests.checks.faults $(FAULTS)

soak: $(DEV)
	$(BIN)/python -m tests.checks.bench.soak $(SOAK)

# Every table of docs/measured, one target after another, with a line for each as it ends. The
# tables that this writes are no local change.
ONLY ?= accuracy bench flags hard-cases kills risk shifts soak stopping transfer \
  docs/tradeoff.png
measured: $(DEV)
	@test -z "`git status --porcelain -uno -- . ':!docs/measured' ':!docs/*.png'`" || \
	  { echo "commit the local changes first: a table names its commit" >&2; exit 1; }
	@mkdir -p $(OUT)/measured; failed=0; for name in $(ONLY); do \
	  began=`date +%s`; state=ok; log=$(OUT)/measured/`basename $$name`.log; \
	  $(MAKE) $$name > $$log 2>&1 || { state=failed; failed=1; }; \
	  echo "$$name `expr \`date +%s\` - $$began` s $$state"; \
	done; exit $$failed

$(VENV)/.upkeep: $(READY)
	$(PIP) --group upkeep
	@touch $@

COMPILE = $(BIN)/uv pip compile pyproject.toml --quiet --no-annotate -c constraints.txt

requirements-board.txt: $(VENV)/.upkeep pyproject.toml constraints.txt
	$(COMPILE) --universal --generate-hashes --custom-compile-command "make $@" -o $@

# setuptools would pack modules that an earlier build left behind.
wheel: $(VENV)/.upkeep
	rm -rf build/lib build/bdist.* dist
	PIP_CONSTRAINT=$(CURDIR)/constraints.txt SOURCE_DATE_EPOCH=1577836800 \
	  $(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps -w dist .
	$(BIN)/python tests/board/recompress.py dist/*.whl

wheel-test: $(DEV) wheel
	$(BIN)/python -m pytest tests/board/test_wheel.py

c-test: $(DEV)
	$(BIN)/python -m pytest tests/export/test_c_code.py tests/export/test_c_graph.py -rs

kernel-test: $(DEV)
	$(BIN)/python -m pytest tests/board/test_kernel.py -rs --capture=tee-sys

$(VENV)/.browser: $(DEV)
	$(PIP) --group browser
	@touch $@

BROWSED := tests/edge/app/sinks/test_page_in_a_browser.py tests/train/tradeoff/test_slider.py \
  tests/train/report/test_page.py tests/train/study/test_study_report.py tests/test_site.py

browser-test: $(VENV)/.browser $(VENV)/.docs
	$(BIN)/python -m pytest $(BROWSED) -rs

service-test: $(DEV)
	$(BIN)/python -m pytest tests/board/test_service.py -rs

board-test: $(DEV) wheel
	$(BIN)/python -m pytest tests/board/test_aarch64.py -rs --capture=tee-sys

DEMODATA := $(OUT)/demo-data

demo-data: $(READY)
	rm -rf $(DEMODATA)
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMODATA)/known
	$(BIN)/python -m train simulate train/scenes/demo.toml --out $(DEMODATA)/unseen --seed 2012 --trials 1
	$(BIN)/python -m export --data $(DEMODATA)/known --out $(DEMODATA) --decision-points 1.2 \
		--features paper --projection pca --tasks category mobility object --name demo
	PYTHONPATH=. $(BIN)/python tests/board/demo_data.py $(DEMODATA)

HARD := $(OUT)/hard-cases

# Includes the answers of another ONNX Runtime.
hard-cases: hard-cases-versions
	$(BIN)/python -m tests.checks.hard_cases

# Writes golden files of the hard cases, then checks them with other ONNX Runtimes.
OTHER_RUNTIMES ?= 1.22.1 1.26.0 1.32.0
OTHERS := $(OTHER_RUNTIMES:%=$(HARD)/onnxruntime-%)
ELSEWHERE = -m pip install --quiet --disable-pip-version-check \
  $$(grep -E '^(numpy|smbus2)==' constraints.txt)

$(OTHERS:%=%/.ready): $(HARD)/onnxruntime-%/.ready: constraints.txt
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python $(ELSEWHERE) onnxruntime==$*
	@touch $@

hard-cases-versions: $(DEV) $(OTHERS:%=%/.ready)
	$(BIN)/python -m tests.checks.hard_cases.golden --out $(HARD)/golden
	for other in $(OTHERS); do \
	  $(BIN)/python -m tests.checks.hard_cases.elsewhere --golden $(HARD)/golden $$other/bin/python \
	  || exit 1; done

$(VENV)/.mutants: $(DEV)
	$(PIP) --group mutants
	@touch $@

# MUTANTS="--only edge.touch --count 50 --minutes 5": a smaller draw. mutmut forks, and worker
# processes that were started before a fork answer nobody.
mutants: $(VENV)/.mutants
	LOKY_MAX_CPU_COUNT=1 $(BIN)/python -m tests.checks.mutants $(MUTANTS)

# The lines that differ are missing pins (<) and pins that nothing needs (>).
GROUPS := train dev docs browser mutants bench upkeep
constraints: $(VENV)/.upkeep
	$(COMPILE) --no-header --python-version 3.11.9 --python-platform x86_64-manylinux_2_28 \
	  --all-extras $(GROUPS:%=--group %) -o $(VENV)/constraints.txt
	tail -n +2 constraints.txt | diff $(VENV)/constraints.txt -
	@echo "constraints.txt pins exactly what the groups need"

# FUZZ="-k scene": only the readers whose names contain this.
fuzz: $(DEV)
	FUZZ_FILES=5000 $(BIN)/python -m pytest tests/checks/fuzz -n 2 -v $(FUZZ)

# KILLS="--count 10 --only install": fewer of them.
kills: $(DEV)
	$(BIN)/python -m tests.checks.kills $(KILLS)

clean:
	rm -rf build dist mutants
