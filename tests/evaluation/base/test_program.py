"""Command-line programs: faults in one line, help, streams."""

import contextlib
import errno
import subprocess
import sys

from helpers.internal.eval_program import run_program
import pytest
import typer

from evaluation.base import InputError, program
from evaluation.base.commands import Command


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (InputError("FILE: fault"), 2, "error: FILE: fault"),
        (MemoryError(), 2, "error: not enough memory for this input"),
        (FileNotFoundError(2, "gone", "FILE"), 2, "error: FILE: gone"),
        (OSError("full"), 2, "error: standard output: full"),
        (BrokenPipeError(errno.EPIPE, "closed"), 0, ""),
        (
            RuntimeError("Symlink loop from 'x'"),
            2,
            "error: Symlink loop from 'x'",
        ),
    ],
)
def test_faults_are_one_line(monkeypatch, capsys, error, status, line):
    app = typer.Typer()

    @app.command()
    def fail():
        raise error

    # Signal handlers stay as the tests set them.
    monkeypatch.setattr(
        program.interrupts, "interrupt_on_termination", lambda: lambda: False
    )
    monkeypatch.setattr(program.interrupts, "ignore_interrupts", lambda: None)
    monkeypatch.setattr("sys.argv", ["program"])
    with pytest.raises(SystemExit) as raised:
        program.run(app, "program", contextlib.nullcontext())
    assert raised.value.code == status
    assert capsys.readouterr().err == (line and f"program: {line}\n")


@pytest.mark.slow
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_an_interrupt_that_a_library_disguises(number):
    """An extension module that is interrupted fails with an ImportError."""
    script = f"""
import contextlib, signal
from evaluation.base import program
app = program.plain_app()

@app.command()
def load():
    try:
        signal.raise_signal(signal.{number})
    except KeyboardInterrupt:
        raise ImportError("initialization failed")

program.run(app, "program", contextlib.nullcontext())
"""
    result = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (result.returncode, result.stdout, result.stderr) == (
        130,
        "",
        "program: interrupted\n",
    )


@pytest.mark.parametrize("rest", [[], ["--help"], ["a", "--jobs", "2"]])
def test_an_unknown_command_is_refused_with_the_known_ones(capsys, rest):
    app = program.make_program("program", "Summary.", "")
    for name in ("study", "scan"):
        app.command(name)(lambda: print("done"))

    def main():
        program.run(app, "program", contextlib.nullcontext())

    def answer(*words):
        return run_program(capsys, "program", main, *words)

    line = "program: error: unknown command '{}'; there are: study, scan{}\n"
    assert answer("years", *rest) == (2, "", line.format("years", ""))
    misspelt = line.format("studdy", "; did you mean study?")
    assert answer("studdy", *rest) == (2, "", misspelt)
    assert answer("study") == (0, "done\n", "")


def test_a_module_with_a_function_of_its_name_is_a_command(
    tmp_path, monkeypatch, capsys
):
    folder = tmp_path / "found_commands"
    folder.mkdir()
    for name, heading in (("count_up", "Later"), ("import_", "First")):
        (folder / f"{name}.py").write_text(
            f"""GROUP = "{heading}"
def {name}(number: int = 1):
    \"\"\"Do {name}.

    Args:
        number: How often.

    Example:
        program {name} \\\\
            --number 2
    \"\"\"
    print("{name}", number)
"""
        )
    monkeypatch.syspath_prepend(tmp_path)
    app = program.make_program(
        "program",
        "Summary.",
        "",
        commands="found_commands",
        groups=("First", "Later"),
    )

    def main():
        program.run(app, "program", contextlib.nullcontext())

    def answer(*words):
        return run_program(capsys, "program", main, *words)[1]

    assert answer("count-up", "--number", "3") == "count_up 3\n"
    lines = [line.strip() for line in answer("--help").splitlines()]
    headings = lines.index("First:"), lines.index("Later:")
    assert lines[headings[0] + 1] == "import    Do import_."
    assert lines[headings[1] + 1] == "count-up  Do count_up."
    help_text = answer("import", "--help")
    assert "How often." in help_text
    assert help_text.endswith("program import_ \\\n        --number 2\n")


def test_a_command_without_docstrings():
    # As with `python -OO`.
    command = Command("run", help=None, params=[], callback=lambda: None)
    assert command.help == ""


@pytest.mark.parametrize("columns", [60, 120, 200])
def test_help_is_as_wide_as_the_terminal(monkeypatch, capsys, columns):
    app = program.make_program("program", "word " * 90, "")

    @app.command()
    def make():
        """Make."""

    def main():
        program.run(app, "program", contextlib.nullcontext())

    monkeypatch.setenv("COLUMNS", str(columns))
    _, out, _ = run_program(capsys, "program", main, "--help")
    widest = max(map(len, out.splitlines()))
    assert columns - 8 <= widest <= columns


@pytest.mark.slow
@pytest.mark.parametrize("package", ["cns_drake", "evaluation"])
@pytest.mark.parametrize(
    ("closed", "status"), [((), 0), ((1,), 2), ((0, 2), 0), ((0, 1, 2), 2)]
)
def test_streams_that_are_closed(tmp_path, package, closed, status):
    """Shells close them by `>&-`. Later files must not get their numbers."""
    words = [sys.executable, "-m", package, "--version"]
    redirections = " ".join(f"{number}>&-" for number in closed)
    result = subprocess.run(
        ["sh", "-c", f'exec "$@" {redirections}', "sh", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == status
    assert "Traceback" not in result.stderr
    if closed == (1,):
        assert result.stderr.endswith("standard output: Bad file descriptor\n")
        assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_an_argument_that_is_no_text(tmp_path):
    result = subprocess.run(
        [sys.executable, "-m", "evaluation", "tcr", b"\xff.npy", "b.npy"],
        capture_output=True,
        check=False,
    )
    assert result.returncode == 2
    assert result.stderr.count(b"\n") == 1
    assert b"not UTF-8 text" in result.stderr


@pytest.mark.parametrize(
    ("word", "suggested"),
    [("--frame", "--frames"), ("--fames", "--frames")],
)
def test_options_that_continue_a_word_are_suggested_alone(
    capsys, word, suggested
):
    app = program.plain_app()

    @app.command()
    def do(frames: int = 1, frame_names: int = 1, camera_fame: int = 1):
        pass

    def main():
        program.run(app, "program", contextlib.nullcontext())

    status, _, err = run_program(capsys, "program", main, word, "3")
    assert status == 2
    assert suggested in err
    assert ("--camera" in err) <= (word == "--fames")
