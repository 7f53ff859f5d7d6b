"""Commands and options: few, each with one meaning."""

import re

from helpers.internal.eval_program import run_program
import pytest
import typer

from cns_drake import command_line as simulator
from evaluation import command_line as evaluation

# What an option of commands that compare drives says beyond its meaning.
EACH = " Give it once for all drives, or once for each, in order."
PROGRAMS = {"cns-drake": simulator, "cns-eval": evaluation}
GROUPS = {
    name: typer.main.get_command(program.app)
    for name, program in PROGRAMS.items()
}


def run(capsys, program, *words):
    return run_program(capsys, program, PROGRAMS[program].main, *words)


def options(program, command):
    found = GROUPS[program].commands[command].params
    return {one.opts[0]: one for one in found if one.opts[0].startswith("-")}


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("cns-eval pr a b --scores s", "cns-eval scores"),
        ("cns-eval tcr a b --paths", "cns-drake export --format tum"),
        ("cns-eval localise a --estimate e", "evo_ape"),
        ("cns-eval localise a --estimate=e", "evo_ape"),
        ("cns-eval real scans", "docs/real.md"),
        ("cns-drake pairs --format overlap", "truth --format overlaps"),
    ],
)
def test_what_is_gone_names_what_to_use(capsys, words, names):
    status, out, err = run(capsys, *words.split())
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert names in err


def test_a_word_after_two_dashes_is_no_option(capsys):
    words = ("export", "--format", "cns", "--output", "x", "--", "--sensor")
    _, _, err = run(capsys, "cns-drake", *words)
    assert err == "cns-drake: error: --sensor: no such file or folder\n"


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("export a --format cns --spacing 4", "--spacing: not with --format "),
        (
            "export a b --format map-sessions --sequence 4",
            "--sequence: not with --format map-sessions; only with cns, ",
        ),
        (
            "export a b --format map-sessions --absent-in 4",
            "--absent-in: not with --format map-sessions; only with cns, ",
        ),
        ("export a --format film", "film is no .* use cns-drake film"),
        (
            "export a b --format map-truth",
            "map-truth is .* use cns-drake truth",
        ),
        ("export a --format ctm", "no format 'ctm' .*did you mean"),
        ("truth a b --half-extent 9", "--half-extent: only with --format ov"),
    ],
)
def test_what_has_no_effect_is_refused(capsys, tmp_path, words, fault):
    words = (*words.split(), "--output", tmp_path / "out")
    status, out, err = run(capsys, "cns-drake", *words)
    assert (status, out) == (2, "")
    assert re.search(fault, err)
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("layout", "number", "wanted"),
    [
        ("cns", 2, "one drive"),
        ("map-sessions", 3, "two drives"),
    ],
)
def test_formats_have_a_number_of_drives(
    capsys, tmp_path, layout, number, wanted
):
    words = [*"abc"[:number], "--format", layout, "--output", tmp_path / "out"]
    status, _, err = run(capsys, "cns-drake", "export", *words)
    assert status == 2
    fault = f"--format {layout}: give {wanted}, not {number}"
    assert err == f"cns-drake: error: {fault}\n"


# Commands whose results are no numbers: recordings, a report or weights.
WITHOUT_NUMBERS = {
    "city",
    "generate",
    "study",
    "reproduce",
    "train",
    "report",
    "scores",
}


def test_all_that_print_numbers_have_json():
    for program, group in GROUPS.items():
        for name in group.commands:
            has_json = "--json" in options(program, name)
            assert has_json == (name not in WITHOUT_NUMBERS), name


def test_options_of_one_name_have_one_meaning():
    """The same text explains an option in all commands of a kind."""
    meanings = {}
    for program, group in GROUPS.items():
        for name in group.commands:
            for option, one in options(program, name).items():
                key = option, one.metavar or one.nargs
                text = (one.help or "").removesuffix(EACH)
                meanings.setdefault(key, {})[name] = text
    for option in ("--json", "--jobs", "--scheduler", "--columns"):
        texts = [t for (o, _), t in meanings.items() if o == option]
        assert len({text for named in texts for text in named.values()}) == 1
    # A data sheet where a command simulates, a name where it reads.
    lidars = {
        m: set(n.values()) for (o, m), n in meanings.items() if o == "--lidar"
    }
    assert {m: len(texts) for m, texts in lidars.items()} == {
        "PRESET|FILE.yaml": 1,
        "NAME": 1,
    }
    for option, commands in {
        "--start": {"localise"},
        "--quick": {"study"},
        "--recording": {"simulate"},
    }.items():
        found = {
            n
            for (o, _), named in meanings.items()
            for n in named
            if o == option
        }
        assert found == commands, option
