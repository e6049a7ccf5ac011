# Everything the two commands of the README need is set up here; nothing is expected beyond
# Python 3.11+ (with venv), a Rust toolchain and make.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
CORE   := $(shell find core/src -name '*.rs') core/Cargo.toml core/Cargo.lock

.PHONY: demo test test-rust test-python check bench lock clean

demo: $(VENV)/.built
	$(BIN)/impasto demo

test: test-rust check test-python

test-rust:
	cargo test --locked --no-default-features --manifest-path core/Cargo.toml

test-python: $(VENV)/.built
	$(BIN)/pytest

check: $(VENV)/.built
	cargo fmt --check --manifest-path core/Cargo.toml
	cargo clippy --locked --all-targets --manifest-path core/Cargo.toml -- -D warnings
	$(BIN)/ruff check src tests benchmarks
	$(BIN)/ruff format --check src tests benchmarks
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/.built
	$(BIN)/python -m benchmarks

# The environment: locked packages first, then the Rust core and the package itself, editable.
$(VENV)/.installed: requirements/dev.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements/dev.txt
	touch $@

$(VENV)/.built: $(VENV)/.installed pyproject.toml $(CORE)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

# Lock files hold versions and hashes, never download addresses. Needs uv.
lock:
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
	  --group dev pyproject.toml --output-file requirements/dev.txt
	cargo generate-lockfile --manifest-path core/Cargo.toml

clean:
	rm -rf $(VENV) core/target demo
