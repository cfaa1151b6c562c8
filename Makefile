# Two commands do everything on a fresh machine: `make run` and `make test`.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
ARGS ?=
# Two workers suit two cores; the browser tests of one file stay together.
PYTEST := $(BIN)/pytest -n 2 --dist loadfile

.PHONY: run install plots test test-all check format lock browser clean

run: $(STAMP)  ## start the server on 127.0.0.1:8080
	$(BIN)/hindsight run --open $(ARGS)

install: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Hindsight needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>&1). Say: make PYTHON=python3.12 …"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
	  { echo "Python's venv module is missing; on Debian: apt-get install python3-venv"; exit 1; }
	@echo "Installing the locked packages into $(VENV) (a minute or two, once) …"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@$(BIN)/python -m app.web.vendor
	@touch $@

plots: $(STAMP)  ## fetch the review page's plotting library again (needs the network)
	@$(BIN)/python -m app.web.vendor

browser: $(STAMP)  ## find or install a Chromium for the browser tests
	@$(BIN)/python tests/find_browser.py

# A browser with software GL needs both cores to itself: those tests run one by one.
test: $(STAMP) browser  ## all tests but the slow ones, at most 8 minutes on two cores
	$(PYTEST) -m "not slow and not browser"
	$(BIN)/pytest -m "browser and not slow"

test-all: $(STAMP) browser  ## what `make test` leaves out, at most 30 minutes on two cores
	$(BIN)/pytest -n 2 --dist worksteal -m "slow and not browser"
	$(BIN)/pytest -m "slow and browser"

check: $(STAMP)  ## style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

lock:  ## write requirements.lock anew from pyproject.toml (needs uv)
	uv pip compile pyproject.toml --group dev --universal --python-version 3.11 \
	  --generate-hashes --no-emit-index-url --no-header --no-annotate --quiet -o requirements.lock

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis *.egg-info
