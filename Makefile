# Each target makes .venv and installs what constraints.txt pins by itself. Needed: Python 3.11 or newer, make, an index.
# Pythons for which pybullet has wheels come first; for others pip compiles it.
PYTHON ?= $(or $(shell for p in python3.11 python3.12 python3.13 python3; do $$p -c "" 2>/dev/null && echo $$p && break; done),python3)
BIN := .venv/bin
PINS := pyproject.toml constraints.txt tools/install.py

.NOTPARALLEL:
.PHONY: help run rl test check bench accuracy campaign mutants readme docs clean
help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-9s %s\n", $$1, $$2}' Makefile

run: .venv/.run-stamp ## drive the paper's first path and print, beside the truth, what the flies found
	$(BIN)/flysim run paper_a

rl: .venv/.rl-stamp ## put stable-baselines3 and torch into .venv, for flysim train

test: check ## format, lint, types, then all tests but the long ones
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not accuracy and not endurance"

check: .venv/.dev-stamp ## format, lint, types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright --pythonpath $(BIN)/python

bench: .venv/.dev-stamp ## how fast the engine is, beside dense matchers, and a stop; takes minutes
	$(BIN)/flysim bench engine
	$(BIN)/flysim bench stop

docs: .venv/.docs-stamp ## build the documentation's site into build/site; a dead link fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict -f tools/mkdocs.yml

readme: .venv/.dev-stamp ## renew the figures and pictures of README and docs that are stale; all: hours. FIGURES="NAME ..."
	$(BIN)/python tools/readme.py $(FIGURES)

campaign: .venv/.dev-stamp ## damaged inputs, kills, full disks and a thousand resets, counted; a quarter of an hour
	$(BIN)/python tests/campaign

accuracy: .venv/.dev-stamp ## the long tests: paths over many seeds, large corpora, every command of the docs; takes an hour
	$(BIN)/python -m pytest -m accuracy -s tests

mutants: .venv/.dev-stamp ## of one-line mutants of engine, obstacles, truth and evaluation, how many tests kill; half an hour
	$(BIN)/python tools/mutants.py $(MUTANTS)

clean: ## remove .venv, caches and what was built; runs/out stays
	rm -rf .venv .pytest_cache .ruff_cache .hypothesis build dist
	find flysim worlds tests tools -name __pycache__ -prune -exec rm -rf {} +

.venv/.run-stamp: $(PINS)
	@"$(PYTHON)" tools/install.py
	@touch $@

.venv/.rl-stamp: $(PINS)
	@"$(PYTHON)" tools/install.py rl
	@touch .venv/.run-stamp $@

.venv/.docs-stamp: $(PINS)
	@"$(PYTHON)" tools/install.py docs
	@touch .venv/.run-stamp $@

.venv/.dev-stamp: $(PINS)
	@"$(PYTHON)" tools/install.py dev
	@touch .venv/.run-stamp $@
