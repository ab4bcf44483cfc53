# `make demo` and `make test` do everything on a machine with Python 3.11; nothing else needs to be set up.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.PHONY: demo test lint format claims sweep reproduce benchmarks pictures clean

demo: .venv/base.installed  ## plan the paper's two motions, print the tables, draw the pictures into demo/
	@mkdir -p demo
	@echo "Planning the paper's two motions (the first run compiles for some seconds) ..."
	@$(BIN)/jet-gym plan paper --planner gas --planner ga --planner gaex --planner policy+refine --planner optimal --output demo/plan.json --plot demo/paper.png

test: .venv/full.installed lint  ## lint, types, tests with coverage
	@$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --cov --cov-report=term:skip-covered

lint: .venv/full.installed
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/deptry .

format: .venv/full.installed
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

claims sweep: .venv/base.installed  ## what the paper says, measured; what the smoothness weight does
	@$(BIN)/jet-gym $@

reproduce: .venv/full.installed  ## the whole paper, and a page that holds its claims against what is measured
	@$(BIN)/jet-gym reproduce --output reproduction

benchmarks: .venv/full.installed  ## speed as ratios against other libraries
	@$(BIN)/python -m benchmarks

pictures: .venv/full.installed  ## the pictures of README and docs
	@$(BIN)/jet-gym plan forward --output docs/images/plan.json --plot docs/images/forward.png
	@rm docs/images/plan.json docs/images/forward.png
	@$(BIN)/jet-gym sweep --plot docs/images/smoothness-sweep.png
	@$(BIN)/jet-gym balance-space --plot docs/images/balance-space.png
	@$(BIN)/jet-gym reproduce --output reproduction
	@cp reproduction/figures/estimates.png reproduction/figures/fig-11-experiment.png docs/images/
	@$(BIN)/python examples/frame.py docs/images/across-the-ditch.png

.venv/base.installed: pyproject.toml constraints.txt | .venv/bin/python
	@echo "Installing jet_gym into .venv ..."
	@$(PIP) --editable .
	@touch $@

.venv/full.installed: pyproject.toml constraints.txt | .venv/bin/python
	@echo "Installing jet_gym with everything into .venv ..."
	@$(PIP) --editable ".[train,bench,dataset,studio,dev]"
	@touch $@ .venv/base.installed

.venv/bin/python:
	@echo "Making .venv with $(PYTHON) ..."
	@$(PYTHON) -m venv .venv

clean:
	rm -rf .venv demo reproduction dist build .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis
