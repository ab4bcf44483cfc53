# `make demo` and `make test` do everything on a machine with Python 3.11; nothing else needs to be set up.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --disable-pip-version-check --constraint constraints.txt

# What pip collects, a line each, so that one sees it go on; its exit code counts, not that of the filter.
PROGRESS := | sed -un -e 's/^Collecting \([^ ]*\).*/  \1/p' -e 's/^\(Installing collected\) .*/  \1 packages .../p'
SHELL := bash
.SHELLFLAGS := -o pipefail -c

.PHONY: demo test test-base lint format docs claims sweep reproduce benchmarks endurance fuzz mutate wheel-check pictures learning-curves clean

demo: .venv/base.installed  ## plan the paper's two motions, print the tables, draw the pictures into demo/
	@mkdir -p demo
	@echo "Planning the paper's two motions with five planners (the first run compiles for about a minute) ..."
	@$(BIN)/jet-gym plan paper --planner gas --planner ga --planner gaex --planner policy+refine --planner optimal --output demo/plan.json --plot demo/paper.png
	@if $(BIN)/python -c "import pybullet" >/dev/null 2>&1; \
	then echo "Stepping across the ditch in simulation ..."; $(BIN)/python examples/frame.py demo/across-the-ditch.png; \
	else echo "No frame of the simulated robot: PyBullet is not installed, pip install 'jet-gym[bullet]'"; fi

test: .venv/full.installed lint docs  ## lint, types, documentation, tests with coverage
	@$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --cov --cov-report=term:skip-covered

test-base:  ## the base install and its tests with another Python: make test-base PYTHON=python3.13
	@[ -x build/base-$(notdir $(PYTHON))/bin/python ] || $(PYTHON) -m venv build/base-$(notdir $(PYTHON))
	@build/base-$(notdir $(PYTHON))/bin/python -m pip install --disable-pip-version-check --upgrade --editable . pytest hypothesis $(PROGRESS)
	@build/base-$(notdir $(PYTHON))/bin/python -m pytest -r s

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

benchmarks: .venv/full.installed  ## speed as ratios against other libraries, written into docs too
	@$(BIN)/python -m benchmarks --json docs/benchmarks.json --page docs/benchmarks.md

endurance: .venv/full.installed  ## ten thousand simulated episodes: memory, numbers, crashes; an hour or two
	@$(BIN)/python -m benchmarks.endurance

fuzz: .venv/full.installed  ## damaged files and arbitrary arguments, for a quarter of an hour
	@JET_GYM_FUZZ=40 $(BIN)/python -m pytest tests/test_fuzz_files.py tests/test_fuzz_robots.py tests/test_fuzz_commands.py

# At most so many mutants of each module: the first of an order that a seed draws. All of them where it is empty.
MUTANTS ?=
define DRAW
import random, sqlite3, sys
mutants = sqlite3.connect(sys.argv[1])
left = sorted(mutants.execute("SELECT operator_name, occurrence, job_id FROM mutation_specs WHERE job_id NOT IN (SELECT job_id FROM work_results)"))
random.Random(0).shuffle(left)
mutants.executemany("INSERT INTO work_results (job_id, worker_outcome) VALUES (?, 'SKIPPED')", [row[2:] for row in left[int(sys.argv[2] or len(left)):]])
mutants.commit()
endef
export DRAW

# The modules that are mutated, each followed by what else tests/test_*.py holds it to.
MUTATED := "fitness" "balance least_thrust assigned_zmp edge_polygon balance_settings" "kinematics inverse_kinematics singular_legs"

mutate: .venv/full.installed  ## mutants of the mathematics against its tests, in a copy of the source; an hour and a half of a core
	@$(PIP) --quiet cosmic-ray
	@mkdir -p build && rm -rf build/mutants && git worktree prune && git worktree add --quiet --detach build/mutants && ln -s ../../.venv build/mutants/.venv
	@cd build/mutants && for names in $(MUTATED); do \
	  module=$${names%% *}; tests=$$(printf "tests/test_%s.py " $$names); \
	  sed -e "s|MODULE|$$module|" -e "s|TESTS |$$tests|" cosmic-ray.toml > $$module.toml && .venv/bin/cosmic-ray init $$module.toml $$module.sqlite && \
	  .venv/bin/cr-filter-operators $$module.sqlite $$module.toml && .venv/bin/python -c "$$DRAW" $$module.sqlite "$(MUTANTS)" && \
	  .venv/bin/cosmic-ray exec $$module.toml $$module.sqlite && .venv/bin/cr-report $$module.sqlite --show-diff --surviving-only || exit; done

wheel-check: .venv/full.installed  ## the wheel in an empty environment: what it costs, and whether it works
	@$(BIN)/python -m benchmarks.install

docs: .venv/full.installed  ## the documentation into docs/_build/html; every warning is an error
	@mkdir -p docs/_generated
	@PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m sphinx --builder html --fail-on-warning --keep-going --quiet -d docs/_build/doctrees docs docs/_build/html
	@echo "docs/_build/html/index.html holds the documentation"

pictures: .venv/full.installed  ## the pictures of README and docs, but the learning curves
	@mkdir -p demo
	@$(BIN)/jet-gym plan forward --output demo/plan.json --plot demo/forward.png
	@cp demo/forward-locomotion.png docs/images/forward-locomotion.png
	@$(BIN)/jet-gym sweep --plot docs/images/smoothness-sweep.png
	@$(BIN)/jet-gym balance-space --plot docs/images/balance-space.png
	@$(BIN)/jet-gym compare --steps 100 --seed 1 --plot docs/images/compare.png
	@$(BIN)/jet-gym robustness --trials 40 --output demo/robustness.json --plot docs/images/robustness.png
	@$(BIN)/jet-gym reproduce --output reproduction
	@cp reproduction/figures/estimates.png reproduction/figures/fig-11-experiment.png docs/images/
	@$(BIN)/python examples/gas_agent_video.py docs/images/across-the-ditch.webp
	@$(BIN)/python docs/_pictures/environment.py docs/images/environment.png
	@$(BIN)/python docs/_pictures/studio.py docs/images/studio.png

learning-curves: .venv/full.installed  ## five seeds trained, in an hour, and their curves
	@for seed in 0 1 2 3 4; do \
	  [ -e runs/curves-seed$$seed/test.json ] || $(BIN)/python train.py --seed $$seed --threads 1 --output runs/curves-seed$$seed || exit; done
	@$(BIN)/python -m agents.training.curves runs/curves-seed* --plot docs/images/learning-curves.png

.venv/base.installed: pyproject.toml constraints.txt | .venv/bin/python
	@echo "Installing jet_gym into .venv ..."
	@$(PIP) --editable . $(PROGRESS)
	@touch $@

.venv/full.installed: pyproject.toml constraints.txt | .venv/bin/python
	@echo "Installing jet_gym with everything into .venv ..."
	@$(PIP) --editable ".[video,train,bench,dataset,studio,docs,dev]" $(PROGRESS)
	@touch $@ .venv/base.installed

.venv/bin/python:
	@echo "Making .venv with $(PYTHON) ..."
	@$(PYTHON) -m venv .venv

clean:
	rm -rf .venv demo reproduction dist build docs/_build docs/_generated .coverage* .pytest_cache .mypy_cache .ruff_cache .hypothesis
