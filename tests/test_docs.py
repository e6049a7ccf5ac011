"""The documentation is complete: every command, every public function, every source cited."""

import importlib
import inspect
import operator
import pkgutil
import re
from pathlib import Path

import pytest
import typer

import impasto
from impasto.cli.commands import app

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
PROGRAM = typer.main.get_command(app)


def commands(group, path=()):
    """Yield each subcommand in the order of the help, by its full name: "fit" or "calibrate lights"."""
    for name in group.list_commands(None):
        command = group.commands[name]
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


COMMANDS = dict(commands(PROGRAM))
MODULES = [
    importlib.import_module(module.name)
    for module in pkgutil.walk_packages(impasto.__path__, "impasto.")
    if not module.name.rpartition(".")[2].startswith("_")
]


def public(kind):
    """Return the public functions or classes of every module, by their full name."""
    return {
        f"{module.__name__}.{name}": member
        for module in MODULES
        for name, member in inspect.getmembers(module, kind)
        if member.__module__ == module.__name__ and not name.startswith("_")
    }


def test_commands_stand_in_the_order_of_the_pipeline():
    assert PROGRAM.list_commands(None) == [
        "capture",
        "simulate",
        "calibrate",
        "stack",
        "fit",
        "render",
        "maps",
        "height",
        "evaluate",
        "compare",
        "gonio",
        "gloss",
        "angles",
        "experiment",
        "observers",
        "scale",
        "report",
        "view",
        "publish",
        "reproduce",
        "models",
        "demo",
    ]


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_is_explained(name):
    command = COMMANDS[name]
    assert command.help
    assert re.match(rf"Example: impasto {name}\b", command.epilog)
    assert all(parameter.help for parameter in command.params)
    assert any(f"impasto {name}" in page.read_text(encoding="utf-8") for page in PAGES)
    # `impasto calibrate lights` is impasto.calibrate.lights in Python; impasto.capture reads captures.
    path = name.replace("capture ", "stand ").replace(" ", ".")
    assert callable(operator.attrgetter(path)(impasto)) or name == "models"


@pytest.mark.parametrize("name", COMMANDS)
def test_each_example_is_a_command_that_parses(name):
    """The example names only options that exist, with values of the right kind."""
    words = COMMANDS[name].epilog.removeprefix(f"Example: impasto {name}").split()
    context = COMMANDS[name].make_context(name, words)
    assert not context.args


@pytest.mark.parametrize("name", sorted(public(inspect.isfunction)))
def test_each_public_function_is_documented(name):
    function = public(inspect.isfunction)[name]
    assert function.__doc__, name
    if function in (getattr(impasto, exported) for exported in impasto.__all__):
        for parameter in inspect.signature(function).parameters:
            assert re.search(rf"^ *(\w+, )*{parameter}(, \w+)* : ", function.__doc__, re.MULTILINE), parameter
        assert "Returns\n" in function.__doc__
        assert "Raises\n" in function.__doc__


@pytest.mark.parametrize("name", sorted(public(inspect.isclass)))
def test_each_public_class_is_documented(name):
    documented = public(inspect.isclass)[name].__doc__
    assert documented
    # What dataclasses write by themselves is no documentation.
    assert not documented.startswith(f"{name.rpartition('.')[2]}(")


def cited():
    """Return every key cited in the source, and where."""
    found = {}
    shaders = (ROOT / "viewer" / "src").rglob("*.ts")
    for path in [*(ROOT / "src").rglob("*.py"), *(ROOT / "core" / "src").rglob("*.rs"), *shaders, *PAGES]:
        if path.name == "references.md":
            continue
        pattern = r"\[([A-Z][\w.:-]*\d)\]_?" if path.suffix in (".rs", ".ts") else r"\[([A-Z][\w.:-]*)\]_"
        for key in re.findall(pattern, path.read_text(encoding="utf-8")):
            found.setdefault(key, path.relative_to(ROOT))
    for spec in impasto.models.MODELS.values():
        for key in spec.citations:
            found.setdefault(key, "impasto models")
    return found


def test_every_source_cited_is_in_the_bibliography_and_the_reverse():
    text = (ROOT / "docs" / "references.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \*\*\[(.+?)\]\*\* ", text, re.MULTILINE)
    assert listed == sorted(set(listed), key=str.casefold)
    used = cited()
    assert {key: where for key, where in used.items() if key not in listed} == {}
    assert set(listed) - set(used) == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text)
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_in_the_texts_exist(page):
    blocks = re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    for block in blocks:
        for words in re.findall(r"^impasto (.+?)(?: +#.*)?$", block, re.MULTILINE):
            name = max((known for known in COMMANDS if f"{words} ".startswith(f"{known} ")), key=len)
            COMMANDS[name].make_context(name, words.removeprefix(name).split())
