"""Results and notes on the terminal."""

import pytest

from evaluation.base import terminal


def test_terminals_break_messages_between_words(monkeypatch, capsys):
    message = f"{'x' * 50}/{'y' * 30}: a-b " + "hyphen-ated " * 20
    terminal.note(message)
    assert capsys.readouterr().err == f"{message}\n"
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(terminal.sys.stderr, "isatty", lambda: True)
    terminal.note(message)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(lines).split() == message.split()
    assert max(map(len, lines[1:])) <= 40 < len(lines[0])


def test_an_interrupt_says_what_goes_on(capsys):
    with (
        pytest.raises(KeyboardInterrupt),
        terminal.resumable(),
        terminal.resumable(),
    ):
        raise KeyboardInterrupt
    assert capsys.readouterr().err.count("run the same command again") == 1


def test_what_is_shown_moves_no_cursor(capsys):
    terminal.note("a\x1b[31mb\nc\x9bd")
    terminal.print_rows([("x\x1b[2J", "1\x07")])
    out, err = capsys.readouterr()
    assert err == "a [31mb\nc d\n"
    assert out == "x [2J  1 \n"
