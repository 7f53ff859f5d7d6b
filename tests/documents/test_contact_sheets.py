"""Contact sheets show all of a page, on a desk and on a phone."""

from helpers.browser import has_chromium
import numpy as np
from PIL import Image
import pytest

from docs import contact_sheets

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not has_chromium(), reason="no chromium"),
]

HEAD = """<!doctype html>
<meta name="viewport" content="width=device-width, initial-scale=1">"""
PAGE = """<style>body {{ margin: 0 }}
div {{ height: 1200px; background: rgb{0} }}
section {{ height: 1200px; background: rgb{1} }}</style>
<div></div><details><summary>more</summary><section></section></details>"""
COLOURS = ((200, 30, 30), (30, 30, 200), (30, 200, 30))


def share_of(colour, files):
    pixels = np.concatenate(
        [np.asarray(Image.open(file)).reshape(-1, 3) for file in files]
    )
    return (np.abs(pixels - np.array(colour)) < 8).all(axis=1).sum()


@pytest.mark.night
def test_sheets_show_all_of_a_page_and_each_picture(tmp_path, capsys):
    shown = tmp_path / "shown"
    shown.mkdir()
    (shown / "page.html").write_text(HEAD + PAGE.format(*COLOURS))
    Image.new("RGB", (40, 30), COLOURS[2]).save(shown / "a.png")
    # It shows the same as the PNG beside it.
    Image.new("RGB", (40, 30), COLOURS[2]).save(shown / "a.webp")
    (shown / "notes.txt").write_text("no picture")
    files = contact_sheets.main(tmp_path / "sheets", [shown])
    for width in contact_sheets.WIDTHS:
        pages = [one for one in files if f"_page_{width}_" in one.name]
        for colour in COLOURS[:2]:
            # The fold is open, and nothing is shown twice.
            assert share_of(colour, pages) == 1200 * width
    assert share_of(COLOURS[2], files) == 40 * 30
    for file in files:
        with Image.open(file) as sheet:
            assert sheet.width <= 1600
    assert capsys.readouterr().out == ""


def test_a_page_that_is_too_wide_is_told(tmp_path, capsys):
    page = tmp_path / "wide.html"
    page.write_text(f'{HEAD}<div style="width: 700px">a</div>')
    contact_sheets.main(tmp_path / "sheets", [page])
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith(f"{page}, 390 px: ")
    assert line.endswith(" px wide")
