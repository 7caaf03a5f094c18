PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= build
READY := $(VENV)/.ready

.PHONY: help venv test lint types export demo bench clean

help:
	@echo "make test     what CI runs: lint, types, tests"
	@echo "make export   DATA=folder of recordings (the simulated set without it) OUT=build"
	@echo "make demo     export, then replay: decisions on a small simulated set"
	@echo "make bench    speed, side by side with the alternatives"

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

clean:
	rm -rf build dist
