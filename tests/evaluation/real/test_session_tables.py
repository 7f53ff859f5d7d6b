"""`cns-eval real` on results of other programs over sessions."""

from helpers.eval_program import run
from PIL import Image
import pytest

from cns_drake.base.errors import InputError
from evaluation.real.session_tables import draw_sessions, read_sessions
from evaluation.results.table import Results

CURVE = "days,r1,low,high,remark\n446,0.75,0.74,0.77,\n20,0.83,0.82,0.84,snow\n"


def fill(root, **files):
    """Writes tables by name; returns their folder."""
    folder = root / "sessions"
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / f"{name}.csv").write_text(text)
    return folder


def test_rows_and_chart(tmp_path, capsys):
    fill(tmp_path / "data", mine=CURVE, other="days,r1,low,high\n0,1,1,1\n")
    output = tmp_path / "out"
    status, out, err = run(
        capsys, "real", tmp_path / "data", "--output", output
    )
    assert (status, out) == (0, f"{output / 'results.csv'}\n"), err
    rows = Results.read(output).rows
    found = [(row.method, row["days"], row.metric, row.value) for row in rows]
    # In the order of days.
    assert found == [
        ("mine", 20.0, "r1", 0.83),
        ("mine", 446.0, "r1", 0.75),
        ("other", 0.0, "r1", 1.0),
    ]
    assert (rows[0].low, rows[0].high, rows[0].n) == (0.82, 0.84, None)
    assert {(row.experiment, row.protocol) for row in rows} == {("real", "own")}
    # Nobody says that two programs were measured alike.
    assert rows[0].protocol_digest != rows[2].protocol_digest
    assert f"{output / 'sessions.png'}: the sessions" in err
    with Image.open(output / "sessions.png") as image:
        assert min(image.size) > 300


def test_the_chart_shows_each_file(tmp_path):
    rows = read_sessions(fill(tmp_path, a=CURVE, b=CURVE), "real")
    picture = draw_sessions(rows, tmp_path)
    first = picture.read_bytes()
    assert draw_sessions(rows, tmp_path).read_bytes() == first
    draw_sessions(rows[:2], tmp_path)
    assert picture.read_bytes() != first


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "no column 'days'"),
        ("days,r1,low\n1,1,1\n", "no column 'high'"),
        ("days,r1,low,high\n", "no row"),
        ("days,r1,low,high\n1,.5,.4\n", "line 2: 3 cells instead of 4"),
        ("days,r1,low,high\n1,half,.4,.6\n", "line 2: r1: 'half'"),
        ("days,r1,low,high\n1,50,40,60\n", "line 2: r1: '50'"),
        ("days,r1,low,high\n1,nan,.4,.6\n", "line 2: r1: 'nan'"),
        ("days,r1,low,high\n-1,.5,.4,.6\n", "line 2: days: -1 is negative"),
        (f"{CURVE}20,.5,.4,.6,\n", "line 4: days: 20 is there twice"),
        ("days,r1,low,high\n1,.5,.6,.7\n", "line 2: not in the order 0, low"),
        ("days,r1,low,high\n1,.5,.3,.4\n", "line 2: not in the order 0, low"),
        ("days,r1,low,high\n1,.5,-.3,.6\n", "line 2: not in the order 0, low"),
    ],
)
def test_faults_are_named(tmp_path, text, fault):
    folder = fill(tmp_path, mine=text)
    with pytest.raises(InputError) as caught:
        read_sessions(folder, "real")
    assert str(caught.value).startswith(f"{folder / 'mine.csv'}: ")
    assert fault in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_empty_folder(tmp_path):
    assert read_sessions(tmp_path / "none", "real") == []
    with pytest.raises(InputError, match="no table"):
        read_sessions(fill(tmp_path), "real")
