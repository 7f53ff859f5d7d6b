"""A recording's names of map and stage are text, neither paths nor code."""

import html
from pathlib import Path

from helpers import studies
from helpers.small_towns import drive
import pytest

from cns_drake.base.file_names import file_name
from evaluation.results.method_names import Table
from evaluation.study.chosen_methods import MethodChoice
from evaluation.study.recordings.map_drives import MapDrives, RecordingInfo
from evaluation.study.report_jobs.figures import change_stems

STAGE = r"../../../../evil|$\frac{_%# <b>&"
MAP = "..|[x](y)_$"


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered_figures")
def test_a_report_stays_in_its_folder(tmp_path):
    recordings = tmp_path / "deep" / "er" / "recordings"
    for name, stage in (("a", "01"), ("b", STAGE), ("c", "/evil")):
        drive(recordings / name, stage, "a", city=MAP)
    output = tmp_path / "deep" / "er" / "report"
    before = set(tmp_path.rglob("*"))
    solid = MethodChoice("solid")
    page = studies.report(recordings, output, [solid])
    new = set(tmp_path.rglob("*")) - before
    assert all(output in path.parents or path == output for path in new)
    assert len(list((output / "figures").glob("change_*.png"))) == 2
    # The text is unchanged, and only text.
    assert html.escape(STAGE) in page.read_text()
    assert "<b>&" not in page.read_text()
    latex = (output / "tcr.tex").read_text()
    assert r"../../../../evil|\$\textbackslash{}frac\{\_\%\# <b>\&" in latex
    markdown = (output / "report.md").read_text()
    rows = [x for x in markdown.splitlines() if r"evil\|$\\frac{" in x]
    assert rows
    assert "<b>" not in markdown
    assert "](y)" not in markdown.replace(r"\](y)", "")


def test_markdown_and_latex_of_any_text():
    text = r"a|b \c `d` *e* [f](g) <h> &i $j$ {k} ~l ^m n_o %p #q"
    table = Table(("x",), ((text,),), caption=text)
    row = table.to_markdown().splitlines()[-1]
    assert row == (
        r"| a\|b \\c \`d\` \*e\* \[f\](g) &lt;h&gt; &i $j$ {k} ~l ^m n_o"
        " %p #q |"
    )
    escaped = (
        r"a|b \textbackslash{}c `d` *e* [f](g) <h> \&i \$j\$ \{k\}"
        r" \textasciitilde{}l \textasciicircum{}m n\_o \%p \#q"
    )
    assert table.to_latex().count(escaped) == 2


@pytest.mark.parametrize(
    "text",
    [
        "", ".", "..", "../../evil", "/etc/passwd", "a/b", "a\\b", "\0",
        "a,b", "%2E", "\ud800", "x" * 5000, "\n", "~", "-", "a:b", ".x",
        "\u00fcber", "\u2603", "con\u202etxt", "*", "?", '"', "|",
    ],
)  # fmt: skip
def test_a_file_name_of_anything(tmp_path, text):
    name = file_name(text)
    path = tmp_path / name
    path.write_text("x")
    assert [one.name for one in tmp_path.iterdir()] == [name]
    assert path.resolve().parent == tmp_path.resolve()
    assert "," not in name
    assert not name.startswith(".")


def test_different_names_stay_different():
    texts = [
        "a.b", "a%2Eb", ".a", "%2Ea", "a b", "a+b", "A", "a", "", "%~",
        "x" * 121, "x" * 122, "x" * 20, "\udcff", "\u00ff",
    ]  # fmt: skip
    assert len({file_name(text) for text in texts}) == len(texts)
    for usual in ("metropolis_04", "scan-context++", "family 3.5", "b\u00e9"):
        assert file_name(usual) == usual


def test_no_two_figures_have_one_name():
    names = set()
    cases = [
        ("x", "1_2", "3"),
        ("x_1", "2", "3"),
        ("x", "1", "2_3"),
        ("x", "1%u2", "3"),
        ("x", "1%2", "3"),
    ]
    for city, *stages in cases:
        pair = tuple(
            RecordingInfo(stage, Path(stage), city, stage, None)
            for stage in stages
        )
        names.update(change_stems(MapDrives(city, {}, ()), pair))
    assert len(names) == 2 * len(cases)
    usual = tuple(
        RecordingInfo(stage, Path(stage), "my_city", stage, None)
        for stage in ("01", "04")
    )
    assert change_stems(MapDrives("my_city", {}, ()), usual) == (
        "change_my_city_01_04",
        "sets_my_city_01_04",
    )
