# make demo, make test, make check; each makes its own environment first.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: env demo test check campaign bench figures clean
env: $(STAMP)

$(STAMP): requirements-dev.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Python 3.11 or newer is needed; this is " + sys.version.split()[0] + ". Try: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-dev.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $(STAMP)

demo: $(STAMP)
	$(BIN)/sitl run sitl/scenarios/demo.toml --live

test: $(STAMP)
	$(BIN)/python -m pytest -n 2

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	@! grep -nE '^-|://' requirements*.lock  # neither a host nor an option: names, versions and hashes only

campaign: $(STAMP)
	$(BIN)/sitl campaign sitl/scenarios/demo.toml --runs 50

# The planners on the problem set (OMPL too, where requirements-bench.lock is installed), and risk against winds.
bench: $(STAMP)
	$(BIN)/python -m bench
	$(BIN)/python -m bench.reliability

# The papers' figures, into docs/figures.
figures: $(STAMP)
	$(BIN)/python -m bench.figures

clean:
	rm -rf $(VENV) build dist
