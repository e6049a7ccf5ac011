"""The group of subcommands `capture`, in the order of their use."""

from importlib import import_module

from impasto.cli.app import group

commands = group("capture", "Plan, drive and check a capture at the copy stand.")

for _name in ("plan", "run", "check"):
    import_module(f"{__name__}.{_name}")
