"""Tables as text: accepted and refused ones."""

import pytest

from evaluation.base import (
    InputError,
    csv_text,
    read_records,
    read_rows,
    whole_number,
)


def write(tmp_path, content):
    path = tmp_path / "table.csv"
    path.write_bytes(content)
    return path


def test_rows_with_the_numbers_of_their_lines(tmp_path):
    path = write(
        tmp_path, b'\xef\xbb\xbfa, b\r\n\r\n1 ,"x, y"\r\n,\r\n2,\xc3\xbc'
    )
    assert read_rows(path) == [
        (1, ["a", "b"]),
        (3, ["1", "x, y"]),
        (5, ["2", "\u00fc"]),
    ]
    assert read_records(path, ("b",)) == [
        (3, {"a": "1", "b": "x, y"}),
        (5, {"a": "2", "b": "\u00fc"}),
    ]


def test_columns_without_a_name(tmp_path):
    path = write(tmp_path, b"a,b,,\n1,2,,\n")
    assert read_records(path, ("b",)) == [(2, {"a": "1", "b": "2", "": ""})]


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"a,c\n1,2\n", "no column 'b'"),
        (b"", "no column 'b'"),
        (b"a,b\n1,2\n3\n", "line 3: 1 cells instead of 2"),
        (b"a,b\n1,2,3\n", "line 2: 3 cells instead of 2"),
        (b"a,b,a\n1,2,3\n", "column 'a' is there twice"),
        (b'b,"c ",c\n1,2,3\n', "column 'c' is there twice"),
        (b"a,b\n1,\xff\n", "not UTF-8"),
        (b"a,b\n1," + b"7" * 200_000, "not CSV: field larger"),
        (b"a;b\n1;2\n", "separated by semicolons instead of commas"),
        (b"\n1,5;2,5\n", "separated by semicolons instead of commas"),
        (b"a\tb\n1\t2\n", "separated by tabs instead of commas"),
    ],
)
def test_tables_that_are_none(tmp_path, content, fault):
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=rf"table\.csv: {fault}"):
        read_records(path, ("b",))


@pytest.mark.parametrize("content", [b"a,\tb\n1,2\n", b"a,b\n;,2\n"])
def test_other_separators_beside_commas(tmp_path, content):
    assert read_records(write(tmp_path, content), ("b",))[0][1]["b"] == "2"


def test_an_error_is_one_printable_line(tmp_path):
    error = InputError("a\nb\x1b[31m\u202ec\ud800" + "x" * 9000)
    assert str(error).startswith("a b [31m c x")
    assert str(error).isprintable()
    assert len(str(error)) < 2100


@pytest.mark.parametrize("code", [0, 7, 27, 31, 127, 0x9B])
def test_what_a_terminal_would_obey_is_refused(tmp_path, code):
    path = write(tmp_path, f"a,b\n1,x{chr(code)}[31m\n".encode())
    with pytest.raises(InputError, match="line 2: a control character"):
        read_rows(path)


def test_whole_numbers():
    assert whole_number("-12", "x") == -12
    assert whole_number("9" * 18, "x") == 10**18 - 1
    for text in (
        "",
        "1.0",
        "nan",
        "1e3",
        "1_0",
        "\u0661",
        "9" * 19,
        "9" * 5000,
    ):
        with pytest.raises(
            InputError, match=r"^x: .* is no whole number"
        ) as one:
            whole_number(text, "x")
        assert len(str(one.value)) < 100


def test_names_that_are_formulas_are_quoted_and_read_as_they_were(tmp_path):
    names = ["=1+1", "@sum", "-a", "+b", "'=c", "''=d", "'e", "f", "-", "-1e-3"]
    written = csv_text(["=name"], [[name] for name in names])
    cells = written.splitlines()
    assert cells[:3] == ["'=name", "'=1+1", "'@sum"]
    assert not [c for c in cells if c[0] in "=@+-"][:-2]
    path = write(tmp_path, written.encode())
    assert [row for _, row in read_rows(path)] == [
        ["=name"],
        *([n] for n in names),
    ]
