PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= build
READY := $(VENV)/.ready
# Only errors: every editable installation prints a warning.
PINNED := python -m pip install -qq --disable-pip-version-check -c
PIP := $(BIN)/$(PINNED) constraints.txt
# uv installs in a third of the time; pip does where uv cannot be had or finds no registry.
INSTALL = $(BIN)/python -m uv pip install --quiet -c constraints.txt $(1) || $(PIP) $(1)
# Several threads slow down matrices as small as ours, and disturb the processes beside them.
export OPENBLAS_NUM_THREADS := 1

.PHONY: help venv test test-all lint types export demo demo-data golden study tradeoff wheel wheel-test \
  board-test browser-test c-test kernel-test peers-test service-test bench docs constraints check clean

help:
	@echo "Everyday"
	@echo "  make test          lint, types and the fast tests"
	@echo "  make test-all      the slow tests too, as CI runs them"
	@echo "  make export        fit a model to DATA (a folder of recordings; default: simulated ones)"
	@echo "                     and write model.onnx, golden.npz and report.html to OUT (default:"
	@echo "                     build); NAME=... names the model; C=DIR writes it in C99 too;"
	@echo "                     CLUSTER=tcp://HOST:PORT fits on the workers of a Dask scheduler"
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
	@echo "Rarely"
	@echo "  make bench         speed beside the alternatives"
	@echo "  make check         programs that measure and thorough tests, with a table each in"
	@echo "                     docs/measured; ONLY=\"risk kills\" some of them; make risk"
	@echo "                     ARGS=--help one; python -m tests.checks --help lists them"
	@echo "Upkeep"
	@echo "  make golden        renew the small model and outputs that the tests compare with"
	@echo "  make demo-data     renew the model and the touches that the wheel carries"
	@echo "  make constraints   check that constraints.txt pins exactly what the groups need"
	@echo "  make clean         remove build and dist"

# What `make demo` and `make export` need; what a target needs beyond that, it installs itself.
$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	-$(PIP) "pip>=25.1" uv
	@$(call INSTALL,-e . --group train)
	@touch $@

DEV := $(VENV)/.dev

$(DEV): $(READY)
	@$(call INSTALL,--group dev)
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

$(VENV)/.cluster: $(READY)
	@$(call INSTALL,--group cluster)
	@touch $@

export: $(READY) $(if $(CLUSTER),$(VENV)/.cluster)
	$(BIN)/python -m export --data $(RECORDINGS) $(BESIDE) --out $(OUT) --report $(FRONTED) \
	  $(addprefix --name ,$(NAME)) $(addprefix --compare ,$(COMPARE)) $(if $(TEST),--test $(TEST)) \
	  $(addprefix --c ,$(C)) $(addprefix --cluster ,$(CLUSTER)) $(EXPORT)

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

docs/touches.png docs/touches-dark.png: $(READY)
	$(BIN)/python -m train show edge/demo/*.npz --model edge/demo/model.onnx \
	  $(if $(findstring dark,$@),--dark) --out $@

BENCHVENV := $(VENV)/.bench

$(BENCHVENV): $(DEV)
	@$(call INSTALL,--group bench)
	@touch $@

# BENCH="-k region": only the benchmarks whose names contain this.
bench: $(BENCHVENV)
	$(BIN)/python -m pytest tests/checks/bench -o python_files='bench_*.py' -o python_functions='bench_*' \
	  -o filterwarnings=default $(BENCH)

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
	@$(call INSTALL,--group docs)
	@touch $@

docs: $(VENV)/.docs
	$(BIN)/python -m mkdocs build --quiet --strict --site-dir $(OUT)/site

# An environment of its own: aeon 1.6.0 does not take the numpy and pandas that
# constraints.txt pins.
PEERS := $(OUT)/peers

$(PEERS)/.ready: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(PEERS)
	grep -v '^numpy==\|^pandas==' constraints.txt > $(PEERS)/constraints.txt
	$(PEERS)/bin/$(PINNED) $(PEERS)/constraints.txt "pip>=25.1"
	$(PEERS)/bin/$(PINNED) $(PEERS)/constraints.txt -e . --group peers
	@touch $@

peers-test: $(PEERS)/.ready
	$(PEERS)/bin/python -m pytest tests/edge/features/test_kernels.py -k aeon -rs

$(VENV)/.upkeep: $(READY)
	@$(call INSTALL,--group upkeep)
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
	$(BIN)/python -m pytest tests/export/test_c_code.py tests/edge/decide/test_knn.py \
	  tests/export/test_image.py tests/export/test_skin_code.py -rs

kernel-test: $(DEV)
	$(BIN)/python -m pytest tests/board/test_kernel.py -rs --capture=tee-sys

$(VENV)/.browser: $(DEV)
	@$(call INSTALL,--group browser)
	@touch $@

BROWSED := tests/edge/app/sinks/test_page_in_a_browser.py \
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

# The lines that differ are missing pins (<) and pins that nothing needs (>).
GROUPS := train cluster dev docs browser bench upkeep
constraints: $(VENV)/.upkeep
	$(COMPILE) --no-header --python-version 3.11.9 --python-platform x86_64-manylinux_2_28 \
	  --all-extras $(GROUPS:%=--group %) -o $(VENV)/constraints.txt
	tail -n +2 constraints.txt | diff $(VENV)/constraints.txt -
	@echo "constraints.txt pins exactly what the groups need"

# What is rare. `make check ONLY="risk kills"` goes on after one that fails; ARGS="--count 10" are
# options of the program.
CHECKS := accuracy faults flags fuzz hard-cases kills mutants remount risk scale shifts soak \
  test-busy transfer
.PHONY: $(CHECKS)
ONLY ?= $(filter-out remount test-busy,$(CHECKS))

flags transfer: $(BENCHVENV)
accuracy: $(PEERS)/.ready

$(CHECKS): $(DEV)
	$(BIN)/python -m tests.checks --out $(OUT) $(if $(DATA),--data $(DATA) --) $@ $(ARGS)

check: $(DEV)
	@mkdir -p $(OUT)/checks; failed=0; for name in $(ONLY); do \
	  began=`date +%s`; state=ok; log=$(OUT)/checks/$$name.log; \
	  $(MAKE) $$name > $$log 2>&1 || { state=failed; failed=1; }; \
	  echo "$$name `expr \`date +%s\` - $$began` s $$state, see $$log"; \
	done; exit $$failed

clean:
	rm -rf build dist
