"""The group of subcommands `experiment`, in the order of their use."""

from importlib import import_module

from impasto.cli.app import group

commands = group("experiment", "Compare renderings with photographs, by the eyes of observers.")

for _name in ("create", "simulate", "serve", "invite", "export", "forget"):
    import_module(f"{__name__}.{_name}")
