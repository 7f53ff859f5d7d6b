"""The table of drives: complete in files, legible in narrow terminals."""

import re
import sys

import pytest

from cns_drake.command_line.commands.list_ import list_, table_lines
from cns_drake.scenarios import DriveRow, recordable_drives

ROWS = [
    DriveRow(
        sequence=f"a_town_with_a_name_{k}",
        map="a_town_with_a_name",
        stage="01",
        title="",
        checksum="",
        length=1234.4 * k,
        duration=98.76 * k,
        frames=2000 * k,
        structures=500,
        triangles=1_234_567,
    )
    for k in (1, 2)
]


def test_all_columns_are_there_without_a_terminal():
    heading, _, last = table_lines(ROWS, None)
    columns = "drive map stage length time frames structures triangles"
    assert heading.split() == columns.split()
    assert re.split("  +", last) == [
        "a_town_with_a_name_2",
        "a_town_with_a_name",
        "01",
        "2469 m",
        "197.5 s",
        "4000",
        "500",
        "1234567",
    ]


@pytest.mark.parametrize(
    ("width", "columns"),
    [
        (120, "drive map stage length time frames structures triangles"),
        (80, "drive stage length time frames structures triangles"),
        (65, "drive stage length time frames triangles"),
        (50, "drive length time frames"),
        (30, "drive length"),
        (10, "drive"),
    ],
)
def test_columns_give_way_but_not_names(width, columns):
    lines = list(table_lines(ROWS, width))
    assert lines[0].split() == columns.split()
    assert [line.split()[0] for line in lines[1:]] == [
        row.sequence for row in ROWS
    ]
    assert max(map(len, lines)) <= max(width, len(ROWS[0].sequence))
    # In right-aligned columns the last digit is below the heading's last
    # letter.
    if width > 10:
        assert len({len(line) for line in lines}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("width", [60, 80])
def test_shipped_drives_fit_the_terminal(width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    list_()
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    names = [line.split()[0] for line in lines[1:]]
    assert sorted(names) == sorted(recordable_drives())
    assert "triangles" in lines[0]


@pytest.mark.slow
def test_the_terminal_does_not_narrow_what_is_piped(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    list_()
    for line in capsys.readouterr().out.splitlines():
        assert len(re.split("  +", line)) == 8
