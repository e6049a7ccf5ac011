# Everything the two commands of the README need is set up here; nothing is expected beyond
# Python 3.11+ (with venv), a Rust toolchain, Node 20.19+ (with npm) and make.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
CORE   := $(shell find core/src -name '*.rs') core/Cargo.toml core/Cargo.lock
NODE   := viewer/node_modules/.installed
WEB    := src/impasto/web/.built
PAGES  := $(wildcard viewer/*.*) $(shell find viewer/src viewer/public -type f 2>/dev/null)

.PHONY: demo test test-rust test-viewer test-python check bench lock clean browser nginx postgresql

demo: $(VENV)/.built $(WEB)
	$(BIN)/impasto demo

test: test-rust check test-viewer test-python

test-rust:
	cargo test --locked --no-default-features --manifest-path core/Cargo.toml

test-viewer: $(NODE)
	npm --prefix viewer test

test-python: $(VENV)/.built $(WEB) browser nginx postgresql
	$(BIN)/pytest -n 2 --dist loadfile --no-loadscope-reorder

check: $(VENV)/.built $(NODE)
	cargo fmt --check --manifest-path core/Cargo.toml
	cargo clippy --locked --all-targets --manifest-path core/Cargo.toml -- -D warnings
	$(BIN)/ruff check src tests benchmarks
	$(BIN)/ruff format --check src tests benchmarks
	$(BIN)/mypy
	$(BIN)/lint-imports
	npm --prefix viewer run check

bench: $(VENV)/.built $(WEB) browser
	$(BIN)/python -m benchmarks

# The environment: locked packages first, then the Rust core and the package itself, editable.
$(VENV)/.installed: requirements/dev.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements/dev.txt
	touch $@

$(VENV)/.built: $(VENV)/.installed pyproject.toml $(CORE)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

# The pages, which the package carries in src/impasto/web.
$(NODE): viewer/package.json viewer/package-lock.json viewer/.npmrc
	npm --prefix viewer ci
	touch $@

$(WEB): $(NODE) $(PAGES)
	npm --prefix viewer run build
	touch $@

# What the tests need of Debian: a browser for the pages, a web server for published folders, and PostgreSQL, of
# which the tests of the experiment start a server of their own.
debian = apt=$$(command -v apt-get) && [ "$$(id -u)" = 0 ] || apt="sudo $$apt"; \
  $$apt update --quiet && $$apt install --yes --quiet --no-install-recommends

browser:
	@command -v chromium >/dev/null || { $(debian) chromium; }

nginx:
	@command -v nginx >/dev/null || { $(debian) nginx-light; }

postgresql:
	@ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || command -v initdb >/dev/null || { $(debian) postgresql; }

# Lock files hold versions and hashes, never download addresses. Needs uv.
lock:
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
	  --group dev pyproject.toml --output-file requirements/dev.txt
	cargo generate-lockfile --manifest-path core/Cargo.toml
	npm --prefix viewer install --package-lock-only

clean:
	rm -rf $(VENV) core/target demo viewer/node_modules src/impasto/web
