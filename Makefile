# make demo, make test, make check; each makes its own environment first (EXTRAS=bench adds the library planners).
PYTHON ?= python3
VENV ?= .venv
EXTRAS ?=
BIN := $(VENV)/bin
# Compiled modules are kept even where the surroundings forbid it: half of what collecting the tests and starting a command costs.
export PYTHONDONTWRITEBYTECODE :=
STAMP := $(VENV)/.installed
ENV := $(STAMP) $(EXTRAS:%=$(STAMP)-%)
# Errors alone: pip's warnings (of root, of its cache, of paths) are of nothing that who makes this has to mend.
PIP := $(BIN)/python -m pip install -qq --disable-pip-version-check --root-user-action=ignore

.PHONY: env demo test test-long test-faults draws mutants mutants-sample check format docs slowest campaign nightly nightly-reference bench measured figures deb release clean
env: $(ENV)

# What can be asked for with EXTRAS: what requirements-NAME.lock adds to the environment, besides dev, which is always in it.
KNOWN := $(filter-out dev,$(patsubst requirements-%.lock,%,$(wildcard requirements-*.lock)))
UNKNOWN := $(firstword $(filter-out $(KNOWN),$(EXTRAS)))
$(if $(UNKNOWN),$(error EXTRAS=$(EXTRAS): there is no $(UNKNOWN). Known: $(KNOWN) (tests, checks and docs are always in)))

# Why $(PYTHON) cannot make an environment, with the remedy; nothing where it can.
WHY_NOT = $(shell \
  version=$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) || \
    { echo "there is no $(PYTHON) here. Name a Python of 3.11 or newer: make PYTHON=python3.11"; exit; }; \
  $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
    { echo "Python 3.11 or newer is needed; $(PYTHON) is $$version. Try: make PYTHON=python3.11"; exit; }; \
  $(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
    { echo "$(PYTHON) makes no environments. Try: sudo apt install python$$version-venv"; exit; }; \
  [ -e $(VENV)/pyvenv.cfg ] || [ -z "$$(ls -A $(VENV) 2>/dev/null)" ] || \
    echo "$(VENV) is there and is no environment. Name another place: make VENV=.venv")

# An environment is whole when its stamp stands and its Python runs. What is not whole (make was interrupted, the system's
# Python went) is cleared and made anew.
WHOLE := $(shell [ -e $(STAMP) ] && $(BIN)/python -c 'print("yes")' 2>/dev/null)
ifeq ($(WHOLE),)
.PHONY: $(STAMP)
endif

$(STAMP): requirements-dev.lock pyproject.toml
	$(if $(WHY_NOT),$(error $(WHY_NOT)))
	@$(if $(WHOLE),rm -f $(STAMP)*,[ ! -e $(VENV) ] || echo "$(VENV) is half built: it is cleared and made anew.")
	@echo "Making the environment in $(VENV), once: a minute or two, on a slow machine or line up to ten."
	@$(PYTHON) -m venv $(if $(WHOLE),,--clear) $(VENV)
	@echo "Fetching and installing $$(grep -c '==' requirements-dev.lock) packages (pip says nothing until it is done)."
	@$(PIP) --require-hashes -r requirements-dev.lock
	@$(PIP) --no-deps --no-build-isolation -e .
	@touch $(STAMP)
	@echo "The environment in $(VENV) is made."

$(STAMP)-%: requirements-%.lock $(STAMP)
	$(PIP) --require-hashes -r $<
	@touch $@

demo: $(ENV)
	$(BIN)/sitl run sitl/scenarios/demo.toml --live

# The tests' workers would each compile what a cold cache lacks: it is filled once, before them.
KERNELS := $(BIN)/python -c 'from sitl.run.compiled import compile_ahead; compile_ahead()'

test: $(ENV)
	@$(KERNELS)
	$(BIN)/python -m pytest -n 3 --dist worksteal -m "not campaign and not long"

# What takes a second of a core or more (tests/long.txt): whole voyages, browsers, months.
test-long: $(ENV)
	@$(KERNELS)
	$(BIN)/python -m pytest -n 3 --dist worksteal -m long

# What every change sails: the first 300 of the thousand faulty voyages, each seed the same every time.
test-faults: $(ENV)
	$(BIN)/sitl faults --runs 300

# The tests that draw their examples, on new draws each time (every night): what it finds is a defect, and a patch that keeps the
# draw as an @example of its test (git apply .hypothesis/patches/...; it wants "example" imported).
draws: $(ENV)
	@$(KERNELS)
	$(BIN)/python -m pytest -n 3 --dist worksteal -m "not campaign" --hypothesis-profile=new \
	  $$(grep -rlE "^ *@given|StateMachine" tests)

# Whether the tests would notice: one place of the code after the other changed, in memory, and the tests that run it asked.
# All of them would be about a day of two cores (it goes on where it was ended); a sample is another each night, 20 minutes of it.
mutants: $(ENV)
	@$(KERNELS)
	nice $(BIN)/python -m bench.mutants --jobs 2

mutants-sample: $(ENV)
	@$(KERNELS)
	nice $(BIN)/python -m bench.mutants --jobs 2 --sample 25 --seed $$(date +%j) --minutes 20

check: $(ENV)
	$(BIN)/ruff format --check -q .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	@$(MAKE) --no-print-directory docs
	@! grep -nE '^-|://' requirements*.lock  # neither a host nor an option: names, versions and hashes only

# Lay out every file as `make check` wants it.
format: $(ENV)
	$(BIN)/ruff check -q --fix --select I .
	$(BIN)/ruff format -q .

# The documentation, from docs/ and the docstrings: strict, offline, whole in itself.
docs: $(ENV)
	$(BIN)/python -m sphinx -q -E -W --keep-going -c docs . build/docs
	@echo "build/docs/index.html"

# The ten slowest tests, and what their fixtures take.
slowest: $(ENV)
	@$(KERNELS)
	$(BIN)/python -m pytest -n 2 --durations=10

campaign: $(ENV)
	$(BIN)/sitl campaign sitl/scenarios/demo.toml --runs 50

# A fixed set of voyages held against those of the reference, seed by seed; fails where one fails, or all are worse by more than
# luck. make nightly-reference puts tonight's in its place: look at what nightly says first.
NIGHTLY := $(addprefix sitl/scenarios/,demo.toml upwind.toml two-channels.toml lee-shore.toml figures/slalom.toml)
nightly: $(ENV)
	@mkdir -p build && rm -f build/nightly.jsonl build/nightly.facts.jsonl
	@$(BIN)/sitl campaign $(NIGHTLY) --runs 8 --out build/nightly.jsonl --table build/nightly.parquet > build/nightly.log; \
	  sailed=$$?; grep -vE '^(PASSED|FAILED)  ' build/nightly.log; [ -s build/nightly.jsonl ] && \
	  $(BIN)/sitl results compare bench/nightly.parquet build/nightly.parquet --fail-on-worse && exit $$sailed

nightly-reference:
	cp build/nightly.parquet bench/nightly.parquet

# The planners on the problem set (OMPL too, after make env EXTRAS=bench) and what it comes to as a page, how planning scales, what
# answers take over their budget, risk against winds.
bench: $(ENV)
	@mkdir -p build
	$(BIN)/python -m sailbench plan --out build/planners.parquet
	$(BIN)/python -m sailbench page build/planners.parquet --out build/leaderboard.html
	$(BIN)/python -m bench.scaling
	$(BIN)/python -m bench.budgets --overrun
	$(BIN)/python -m bench.reliability

# What the pages show of a command's output, measured again and written there with date and commit; less than an hour of two
# quiet cores.
measured: $(ENV)
	@$(KERNELS)
	$(BIN)/python -m bench.measured

# The papers' figures and the pictures of the rooms, into docs/figures.
figures: $(ENV)
	$(BIN)/python -m bench.rooms
	$(BIN)/python -m bench.figures
	$(BIN)/python -m bench.tracking --figures docs/figures

# The Debian package of this machine's release and architecture, into dist/ (about three minutes; see packaging/).
deb:
	python3 packaging/deb.py

# What is handed out, into dist/: wheel, bill of materials, checksums of all that is there (packages of other releases and
# machines are put there before: packaging/build_in_debian.sh).
release: $(ENV)
	$(BIN)/python -m hatchling build -t wheel -d dist
	cd lab && $(abspath $(BIN))/python -m hatchling build -t wheel -d ../dist
	cd sailbench && $(abspath $(BIN))/python -m hatchling build -t wheel -d ../dist
	$(BIN)/python packaging/sbom.py requirements.lock > dist/sailboat-companion.cdx.json
	cd dist && sha256sum *.whl *.deb *.cdx.json 2>/dev/null > SHA256SUMS; cat SHA256SUMS

clean:
	rm -rf $(VENV) build dist docs/api
