# What a person types: `make demo` and `make test`. Each builds .venv first when there is none or when
# pyproject.toml has changed; all that is needed is Python 3.11 or newer (or PYTHON=/path/to/python) and make.

VENV  := .venv
BIN   := $(VENV)/bin
READY := $(VENV)/.ready

# The demo's pages are opened where a person looks, not in a build.
OPEN = $$(test -t 2 && test -z "$$CI" && echo --open)

.PHONY: demo test pytest test-studies test-all coverage audit docs notebooks lint format package clean

demo: $(READY)
	SMAJAX_PROGRESS=lines $(BIN)/smajax demo --out demo-report $(OPEN)

# Compiled Python is kept, whatever the environment asks for: without it each worker and each command of a test compiles it anew.
unexport PYTHONDONTWRITEBYTECODE

# A file goes to one worker, in which its tests share compiled programs; the longest begin first (tests/conftest.py).
PYTEST = $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder
STUDIES = tests/studies tests/documentation/test_notebooks.py

# Beside one another: mypy takes half a minute on one core.
test: $(READY)
	@$(MAKE) --no-print-directory -j 2 lint pytest

pytest: $(READY)
	$(PYTEST) $(STUDIES:%=--ignore=%)

# What was found with the package rather than the package: the source's figures, the studies' records, the notebooks.
test-studies: $(READY)
	$(PYTEST) $(STUDIES)

test-all: lint
	$(PYTEST) -m "slow or not slow"

# Lines and branches that no test runs, after the tests; a file that is run whole is left out.
coverage: $(READY)
	$(PYTEST) --cov=smajax --cov-branch --cov-report=term-missing:skip-covered

# Known faults of what is installed here, asked of the public list: the one target that needs a network beyond packages.
audit: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check pip-audit
	$(BIN)/pip-audit --local --skip-editable

# site/index.html, which a browser reads and searches from the disk; any warning ends it.
docs: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The notebooks with their outputs, from notebooks/*.py; 05 and 07 read measured data (SMAJAX_DATA).
notebooks: $(READY)
	$(BIN)/python -m studies.make_notebooks

# Wheel and source archive; the wheel must work from an empty folder in an environment of its own, of TRY.
TRY = $(BIN)/python

package: $(READY)
	rm -rf dist build/try
	$(BIN)/python -m build --outdir dist .
	$(TRY) -m venv build/try/env
	build/try/env/bin/python -m pip install --quiet --disable-pip-version-check --no-compile dist/*.whl
	mkdir build/try/empty
	cd build/try/empty && ../env/bin/smajax --version && ../env/bin/smajax presets && ../env/bin/smajax doctor \
	  && ../env/bin/smajax simulate --step 7V:2s --out run && ../env/bin/smajax figures M9 --fast && ../env/bin/python -c 'import smajax; smajax.simulate_dataset'

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# A name on the PATH is no proof of an interpreter that runs, so each candidate is asked for its version.
$(READY): pyproject.toml
	@enough='import sys; sys.exit(sys.version_info < (3, 11))'; \
	if ! $(BIN)/python -c "$$enough" 2>/dev/null; then \
	  found=; \
	  for candidate in $(if $(PYTHON),"$(PYTHON)",python3.14 python3.13 python3.12 python3.11 python3 python); do \
	    if "$$candidate" -c "$$enough" 2>/dev/null; then found=$$candidate; break; fi; \
	  done; \
	  if [ -z "$$found" ]; then \
	    echo "smajax needs Python 3.11 or newer; $(if $(PYTHON),$(PYTHON) is not one,none was found on the PATH)." >&2; \
	    echo "Install one, or say where it is: make PYTHON=/path/to/python3.12 ..." >&2; \
	    exit 1; \
	  fi; \
	  echo "creating $(VENV) with $$found"; \
	  "$$found" -m venv --clear $(VENV) || exit 1; \
	fi
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

clean:
	rm -rf $(VENV) demo-report site build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
