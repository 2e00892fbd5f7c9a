# `make demo` and `make test` do all set-up on a fresh machine; everything goes into .venv and demo/.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MATCHES ?= samples
DEMO := demo

.PHONY: help install browser demo test lint format bench clean

help:
	@echo "make demo     train and report a clone of HELIOS_base on the bundled matches"
	@echo "make test     run the tests"
	@echo "make lint     ruff and mypy"
	@echo "make bench    speed, as ratios (MATCHES=folder of logs)"
	@echo "make install  only set up $(VENV)"

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "teamclone needs Python 3.11 or newer; try make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $@

# One test opens the report in a real browser.
browser:
	@command -v chromium >/dev/null || command -v google-chrome >/dev/null || \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null; \
	  else echo "no chromium on the PATH: the browser test is skipped (Debian: apt-get install chromium)"; fi

demo: install
	rm -rf $(DEMO)
	$(BIN)/teamclone ingest samples --store $(DEMO)/store
	$(BIN)/teamclone dataset --store $(DEMO)/store --team HELIOS_base --unseen YuShan2024 --out $(DEMO)/dataset
	$(BIN)/teamclone train $(DEMO)/dataset --preset small --out $(DEMO)/run
	$(BIN)/teamclone bench $(DEMO)/run
	$(BIN)/teamclone evaluate $(DEMO)/run
	$(BIN)/teamclone report $(DEMO)/run

test: install browser
	$(BIN)/python -m pytest -n 2 --dist loadscope

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: install
	$(BIN)/python benchmarks/pipeline.py $(MATCHES)

clean:
	rm -rf $(VENV) $(DEMO) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
