# Everything runs from .venv, made from requirements.lock (exact versions with hashes, wheels only).
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/installed
# mypy and import-linter do not follow the editable finder; they do follow a folder of links.
LINKS := $(VENV)/links

.PHONY: compare bench test check format lint types layers tests measure browsers picture gallery lock clean

compare: $(STAMP)
	$(BIN)/impactbench compare --out out $(ARGS)

# Speed of the reference, against the engines and against its own size; on a machine that does nothing else.
bench: $(STAMP)
	mkdir -p out
	$(BIN)/impactbench bench --json out/bench.json $(ARGS)

# What CI needs: every check and the tests.
test: check

check: format lint types layers tests

format: $(STAMP)
	$(BIN)/ruff format --check .

lint: $(STAMP)
	$(BIN)/ruff check .

types: $(STAMP)
	MYPYPATH=$(LINKS) $(BIN)/mypy $(LINKS)/impactbench

layers: $(STAMP)
	PYTHONPATH=$(LINKS) $(BIN)/lint-imports --no-cache

tests: $(STAMP)
	$(BIN)/pytest -n auto --dist loadfile $(ARGS)

# Seeded faults of laws, adapters and measures: which of them the gate catches. Some minutes.
mutants: $(STAMP)
	$(BIN)/python -m tests.mutants $(ARGS)

$(STAMP): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	mkdir -p $(LINKS)/impactbench
	for part in scenarios reference adapters reports; do ln -sfn ../../../$$part $(LINKS)/impactbench/$$part; done
	touch $@

# How soon a report is drawn and how smoothly a crowd is replayed, in chromium and by the clock on the wall.
measure: out/report.html
	$(BIN)/python -m tests.measure_page out/report.html

# Browsers for the report's tests, from Debian's packages; needs root.
browsers:
	command -v chromedriver && command -v chromium && command -v firefox-esr \
	  || (apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium chromium-driver firefox-esr)

# The README's picture, from a real run: needs Debian's chromium.
picture: out/report.html
	chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1366,760 --virtual-time-budget=4000 \
	  --screenshot=docs/report.png file://$(CURDIR)/out/report.html

# One example report from a real run (out/report.html, not kept here: some 3 MB) and the README's picture of it.
gallery: compare picture

# New versions: needs uv (pip install uv).
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-annotate \
	  --only-binary :all: --group dev --output-file requirements.lock pyproject.toml

clean:
	rm -rf $(VENV) build *.egg-info
