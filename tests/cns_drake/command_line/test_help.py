"""Help, version and completion of both programs."""

import re
import shlex

import pytest
import typer

import cns_drake
from cns_drake import command_line as cli
from evaluation import command_line as evaluation_cli
from evaluation.lidar_sheets import LIDAR_PRESETS
from worlds.imports import map_sources

PROGRAMS = {
    "cns-drake": typer.main.get_command(cli.app),
    "cns-eval": typer.main.get_command(evaluation_cli.app),
}
COMMANDS = [
    (program, *words)
    for program, group in PROGRAMS.items()
    for words in [(), *((name,) for name in group.commands)]
]
WIDTH = 60


def test_all_presets_are_listed():
    options = {one.name: one for one in find("cns-drake", "simulate").params}
    words = re.findall(r"[a-z0-9-]+", options["lidar"].help.split(": ")[2])
    assert set(words) - {"or"} == set(LIDAR_PRESETS)


def run(capsys, program, *words):
    """Runs a program that ends before any command; returns its stdout."""
    with pytest.raises(SystemExit) as caught:
        PROGRAMS[program].main(list(words), prog_name=program)
    assert not caught.value.code
    return capsys.readouterr().out


def find(program, *words):
    group = PROGRAMS[program]
    return group.commands[words[0]] if words else group


def squeezed(text):
    """Returns a text without white space, which wrapping changes."""
    return "".join(text.split())


@pytest.fixture(params=COMMANDS, ids=" ".join)
def words(request):
    return request.param


@pytest.fixture
def shown(words, capsys, monkeypatch):
    """The help of a command on a narrow terminal."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    return run(capsys, *words, "--help")


def test_help_fits_the_terminal(shown):
    assert max(map(len, shown.splitlines())) <= WIDTH


def test_help_has_every_word(words, shown):
    command = find(*words)
    texts = [command.help, *(each.help for each in command.params)]
    for text in filter(None, texts):
        assert squeezed(text) in squeezed(shown)
    for name, each in getattr(command, "commands", {}).items():
        assert squeezed(name + each.help.split("\n\n")[0]) in squeezed(shown)


def test_help_ends_with_an_example_that_is_good_usage(words, shown):
    _, _, example = shown.partition("\n  Example:\n")
    for line in example.replace("\\\n", " ").splitlines():
        program, name, *arguments = shlex.split(line)
        assert program == words[0]
        assert name in words[1:] or len(words) == 1
        # Bad usage is an exception.
        find(program, name).make_context(name, arguments)
    assert example


def test_options_have_units():
    units = {
        unit
        for words in COMMANDS
        for each in find(*words).params
        for unit in re.findall(r"\[[a-z, ]+\]", each.help or "")
    }
    assert units == {"[m]", "[m, rad]", "[deg]", "[s]"}


@pytest.mark.parametrize("program", PROGRAMS)
def test_called_with_nothing_a_program_shows_its_help(program, capsys):
    assert run(capsys, program) == run(capsys, program, "--help")


@pytest.mark.parametrize("program", PROGRAMS)
def test_version(program, capsys):
    shown = run(capsys, program, "--version")
    assert shown == f"{program} {cns_drake.__version__}\n"


@pytest.mark.parametrize(
    ("program", "begun", "completed"),
    [
        ("cns-drake", "sim", ["simulate"]),
        ("cns-drake", "city --n", ["--new"]),
        ("cns-eval", "pr --mode f", ["filtered"]),
        ("cns-eval", "re", ["report"]),
    ],
)
def test_completion(program, begun, completed, capsys, monkeypatch):
    words = f"{program} {begun}"
    variable = program.upper().replace("-", "_")
    monkeypatch.setenv(f"_{variable}_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert run(capsys, program).split() == completed


def test_the_formats_of_cities_are_listed():
    source = find("cns-drake", "import").params[0]
    formats = [
        f"{one.title} ({', '.join(one.suffixes)})" for one in map_sources()
    ]
    assert source.help == f"File of the city: {', '.join(formats)}."
