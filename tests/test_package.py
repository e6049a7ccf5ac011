"""The package's names: complete, functions rather than modules, and imported when they are asked for."""

import subprocess
import sys
from types import ModuleType

import pytest

import impasto

PACKAGES = {"calibrate", "experiment", "models", "stand"}  # of functions, not functions themselves


def test_each_public_name_is_there():
    for name in impasto.__all__:
        value = getattr(impasto, name)
        assert isinstance(value, ModuleType) == (name in PACKAGES)
        assert callable(value) or name in PACKAGES


def test_importing_a_stage_s_module_does_not_hide_its_function():
    script = "import impasto.fit, impasto.maps; assert callable(impasto.fit) and callable(impasto.maps)"
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_stage_does_not_import_the_others():
    script = "import sys, impasto; impasto.fit; print(*(name for name in sys.modules if 'impasto' in name))"
    loaded = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert "impasto.fit" in loaded.stdout.split()
    assert not {"impasto.capture", "impasto.render", "impasto.demo"} & set(loaded.stdout.split())


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="no attribute 'fitt'"):
        _ = impasto.fitt
