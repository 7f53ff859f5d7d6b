"""Options that are numbers: each command refuses what is none."""

from helpers.internal.eval_program import run_program
import pytest
import typer

from cns_drake import command_line as simulator
from docs.reference_pages import kind_of
from evaluation import command_line as evaluation

PROGRAMS = {"cns-drake": simulator, "cns-eval": evaluation}


def commands():
    """Yields program, command and option, for each option of real numbers."""
    for name, program in PROGRAMS.items():
        group = typer.main.get_command(program.app)
        for command in group.commands.values():
            for one in command.params:
                if kind_of(one) in ("float", "float range"):
                    yield name, command, one


def usual(one):
    """Returns the words of a required argument or option."""
    kind = getattr(one, "type", None) or one.type_descriptor
    choices = getattr(kind, "choices", None) or ["0"]
    word = str(getattr(choices[0], "value", choices[0]))
    words = [word] * max(one.nargs, 1)
    return words if one.param_type_name == "argument" else [one.opts[0], *words]


FOUND = list(commands())


def test_there_are_such_options():
    assert {command.name for _, command, _ in FOUND} >= {
        "pr",
        "localise",
        "export",
        "train",
        "age",
        "simulate",
    }


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize(
    ("program", "command", "option"),
    FOUND,
    ids=[f"{c.name}{o.opts[0]}" for _, c, o in FOUND],
)
def test_it_is_a_finite_number(
    capsys, monkeypatch, tmp_path, program, command, option, value
):
    monkeypatch.chdir(tmp_path)
    words = [command.name, f"{option.opts[0]}={value}"]
    for one in command.params:
        if one.required and one is not option:
            words += usual(one)
    status, out, err = run_program(
        capsys, program, PROGRAMS[program].main, *words
    )
    assert (status, out) == (2, ""), err
    assert err.startswith(f"{program}: error: ")
    assert err.count("\n") == 1
    # Others are checked with the files that they belong to.
    assert option.opts[0] in err or kind_of(option) != "float range"
    assert not list(tmp_path.iterdir())
