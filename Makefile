# `make demo`, `make test` and `make docs` do all set-up on a fresh machine; everything goes into .venv, demo/ and site/.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
MATCHES ?= samples
COPIES ?= 1
TEAM ?= HELIOS_base
KILLS ?= 50
FIDELITY := .fidelity
PANEL := .panel
OPTIONS ?=
MINUTES ?= 30
TESTERS ?= 2
DEMO := demo

.PHONY: help install browser demo test docs notebook lint format bench fidelity ablations faults fuzz clean

help:
	@echo "make demo     train, replay and report a clone of HELIOS_base on the bundled matches"
	@echo "make test     run the tests"
	@echo "make docs     the documentation as one site, site/index.html; its generated pages and figures"
	@echo "make notebook run docs/notebook.ipynb anew"
	@echo "make lint     ruff and mypy"
	@echo "make bench    speed, as ratios (MATCHES=folder of logs, TEAM=name, COPIES='1 3 39' of each match)"
	@echo "make fidelity how good clones of a panel of teams are, and docs/explanation/panel.md from it (MATCHES=folder)"
	@echo "make ablations what makes clones good, and docs/explanation/fidelity.md from it (MATCHES=folder, OPTIONS='--only c,b')"
	@echo "make faults   kill ingest, dataset and train KILLS times each and resume (default 50)"
	@echo "make fuzz     fuzz every log reader for MINUTES (default 30), then their time and memory for as long"
	@echo "make install  only set up $(VENV)"

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "teamclone needs Python 3.11 or newer; try make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $@

# Some tests open pages in a real browser.
browser:
	@command -v chromium >/dev/null || command -v google-chrome >/dev/null || \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium >/dev/null; \
	  else echo "no chromium on the PATH: the browser tests are skipped (Debian: apt-get install chromium)"; fi

demo: install
	rm -rf $(DEMO)
	$(BIN)/teamclone ingest samples --store $(DEMO)/store
	$(BIN)/teamclone dataset --store $(DEMO)/store --team HELIOS_base --unseen YuShan2024 --out $(DEMO)/dataset
	$(BIN)/teamclone train $(DEMO)/dataset --set data.batch_size=512 --set model.extra_kicks=8 --set train.epochs=5 --out $(DEMO)/run
	$(BIN)/teamclone bench $(DEMO)/run -n 4000
	$(BIN)/teamclone evaluate $(DEMO)/run
	$(BIN)/teamclone rollout $(DEMO)/run samples/*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz --starts 12 --samples 16 --horizon 30
	$(BIN)/teamclone replay samples/*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz --run $(DEMO)/run --rollouts $(DEMO)/run/rollouts/fans.json --out $(DEMO)/run/replay.html
	$(BIN)/teamclone scout $(DEMO)/store --team HELIOS_base --run $(DEMO)/run --out $(DEMO)/run/scout.html
	$(BIN)/teamclone report $(DEMO)/run
	$(BIN)/teamclone export $(DEMO)/run --out $(DEMO)/export
	$(BIN)/teamclone export --check $(DEMO)/export

test: install browser
	$(BIN)/python tests/kernels.py
	$(BIN)/python -m pytest -n $(TESTERS) --dist loadscope --no-loadscope-reorder

# Broken links and pages that no menu lists are errors.
docs: install
	$(BIN)/python docs/generate.py
	$(BIN)/python docs/figures.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "Wrote site/index.html; a browser searches only what comes from a server: $(BIN)/python -m http.server -d site"

notebook: install
	$(BIN)/python docs/notebook.py

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: install
	$(BIN)/python benchmarks/reading.py $(MATCHES)
	$(BIN)/python benchmarks/ingest.py $(MATCHES) --copies $(COPIES)
	rm -rf .bench && $(BIN)/teamclone ingest $(MATCHES) --store .bench/store
	$(BIN)/python benchmarks/dataset.py .bench/store --team $(TEAM) --copies $(COPIES)
	$(BIN)/teamclone dataset --store .bench/store --team $(TEAM) --out .bench/dataset >/dev/null
	$(BIN)/python benchmarks/training.py .bench/dataset
	$(BIN)/python benchmarks/stores.py $(MATCHES) --count 2
	$(BIN)/python benchmarks/replay.py $(MATCHES)
	$(BIN)/python benchmarks/scout.py $(MATCHES) --team $(TEAM) --counts 3

fidelity: install
	$(BIN)/python benchmarks/panel.py $(MATCHES) --out $(PANEL) --page docs/explanation/panel.md $(OPTIONS)

ablations: install
	$(BIN)/python benchmarks/fidelity.py $(MATCHES) --out $(FIDELITY) --page docs/explanation/fidelity.md --team $(TEAM) $(OPTIONS)

faults: install
	$(BIN)/python -m pytest tests/faults --kills $(KILLS) --timeout 0

fuzz: install
	$(BIN)/python -m pip install --quiet --disable-pip-version-check atheris
	$(BIN)/python tests/faults/fuzz_readers.py .fuzz --minutes $(MINUTES)
	$(BIN)/python tests/faults/fuzz_bounds.py --minutes $(MINUTES)

clean:
	rm -rf $(VENV) $(DEMO) site .bench $(FIDELITY) .fuzz build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
