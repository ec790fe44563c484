# Everything that one does with a checkout of mimique. `make demo` and `make test` need Python 3.11 or newer and nothing else.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check --quiet
DEBIAN := libegl1 libgl1-mesa-dri libosmesa6

.DEFAULT_GOAL := help
.PHONY: help demo test lint page bench stress docs system-packages clean

help:
	@echo "make demo    install, then run the whole pipeline on simulated signers (leaves a corpus, a report, a film in demo/)"
	@echo "make test    install what the tests need, then run them"
	@echo "make lint    ruff, mypy"
	@echo "make page    build the review page again, after a change to it"
	@echo "make bench   measure speed and accuracy against other software (minutes)"
	@echo "make stress  many processes, kills, damaged files (an hour)"
	@echo "make docs    redraw the figures and tables of the documentation"
	@echo "make system-packages   Debian's packages for drawing without a screen (needs root)"
	@echo "make clean   remove the virtual environment and everything built"

# Films are drawn without a screen: where no software OpenGL is found, install it if we may, else say what to do.
system-packages:
	@if ldconfig -p 2>/dev/null | grep -q 'libOSMesa\.so\|libEGL_mesa\.so'; then :; \
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(DEBIAN) >/dev/null; \
	else echo "No software OpenGL was found; films need it. On Debian: sudo apt-get install $(DEBIAN)"; fi

# One environment for everything; each stamp is one set of packages, renewed when the lists change.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mimique needs Python 3.11 or newer, but $(PYTHON) is $$($(PYTHON) --version 2>&1); try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 2; }
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.core: $(BIN)/python pyproject.toml constraints.txt
	@echo "installing mimique (a few minutes the first time)"
	@$(PIP) install --constraint constraints.txt --editable '.[film]'
	@touch $@

$(VENV)/.test: $(VENV)/.core
	@$(PIP) install --constraint constraints.txt --editable '.[test]'
	@touch $@

# What asks other programs about glTF files is skipped, and says so, where they cannot be had.
tests/node/node_modules: tests/node/package.json $(VENV)/.test
	@cd tests/node && PATH="$(abspath $(BIN)):$$PATH" npm install --no-audit --no-fund --no-package-lock --silent && touch node_modules || \
	  echo "the validator of glTF could not be installed; its tests are skipped"

$(VENV)/.bench: $(VENV)/.core
	@$(PIP) install --constraint constraints.txt --editable '.[bench]'
	@touch $@

$(VENV)/.lint: $(VENV)/.core
	@$(PIP) install --constraint constraints.txt --editable '.[lint]'
	@mkdir -p $(VENV)/source && ln -sfn ../.. $(VENV)/source/mimique  # mypy looks for a folder of the package's name
	@touch $@

demo: system-packages $(VENV)/.core
	@$(BIN)/mimique demo demo

test: system-packages $(VENV)/.test tests/node/node_modules
	@OMP_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses 2  # more threads than cores only wait for each other

lint: $(VENV)/.lint
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

page: $(VENV)/.test
	@$(BIN)/python workbench/review/page/build_page.py

bench: $(VENV)/.bench
	@for script in benchmarks/bench_*.py; do echo "== $$script"; OMP_NUM_THREADS=2 $(BIN)/python $$script || exit 1; done

# What CI does in small: many processes, killed writers, the state machine, a hundred thousand damaged files. An hour.
stress: $(VENV)/.test
	@MIMIQUE_FULL=1 $(BIN)/python -m pytest tests/corpus/test_locking.py tests/corpus/test_s3.py tests/corpus/test_corpus_machine.py
	@OMP_NUM_THREADS=1 $(BIN)/python benchmarks/fuzz_readers.py --cases 100000

docs: system-packages $(VENV)/.core
	@for script in docs/draw_*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

clean:
	rm -rf $(VENV) build dist *.egg-info demo workbench/review/static workbench/review/page/node_modules .pytest_cache .ruff_cache .mypy_cache .hypothesis
