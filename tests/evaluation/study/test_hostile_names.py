"""A recording's names of map and stage are text, neither paths nor code."""

import html
from html.parser import HTMLParser

from helpers.internal import studies
from helpers.small_towns import drive
import pytest

from evaluation.base import file_name
from evaluation.recognition import MethodChoice

STAGE = r"../../../../evil|$\frac{_%# <b>&"
MAP = "..|[x](y)_$"
# Names that would run code in a page: in text, in an attribute, in a script.
ACTIVE = (
    "</script><script>run()</script>",
    "<img src=x onerror=run()>",
    '" onmouseover="run()" x="',
    "javascript:run()",
    "--></title><script>run()</script>",
    "a\u202eb\u2028</style><svg onload=run()>",
)


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


class _Page(HTMLParser):
    """Counts the scripts of a page, and lists what would run beside them."""

    def __init__(self, text):
        super().__init__()
        self.scripts = 0
        self.active = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.scripts += tag == "script"
        self.active += [
            (tag, name, value)
            for name, value in attrs
            if name.startswith("on") or (value or "").startswith("javascript:")
        ]


@pytest.mark.slow
@pytest.mark.usefixtures("unrendered_figures")
def test_names_run_nothing(tmp_path):
    pages = []
    for folder, city, names in (
        ("plain", "town", ("a", "b")),
        ("hostile", ACTIVE[0], ACTIVE[1:]),
    ):
        recordings = tmp_path / folder / "recordings"
        for number, name in enumerate(names):
            own = f"{number}{name}".replace("/", "")
            drive(recordings / own, name, "a", city=city)
        solid = MethodChoice("solid")
        output = tmp_path / folder / "report"
        file = studies.report(recordings, output, [solid])
        pages.append(_Page(file.read_text()))
    assert [page.active for page in pages] == [[], []]
    assert pages[0].scripts == pages[1].scripts > 0


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
