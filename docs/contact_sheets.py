"""Makes contact sheets of web pages and pictures, to look at all of them.

python docs/contact_sheets.py SHEETS PATH ...

Each PATH is a page (.html), a picture, or a folder that contains some. Pages
are shown as on a desk (1440 px wide) and on a phone (390 px), from top to
bottom, with all folds open; a page of a drive is shown as it opens, and with
what changed. The sheets are PNG files in the folder SHEETS, at most 1600 px
wide, so that letters can be read. What a browser complains about is printed.

For all that the README's first command and a study show:

    cns-drake reproduce metropolis --output output
    cns-drake study decay.yaml --output decay
    python docs/contact_sheets.py sheets output decay
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import io
import itertools
from pathlib import Path
import sys
import tempfile

from PIL import Image, ImageDraw, ImageFont

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from helpers.browser import Browser, chromium

# Widths of a desk's and of a phone's screen [pixels].
WIDTHS = (1440, 390)
# Size of a sheet [pixels].
_SHEET = (1600, 1700)
# Greatest number of screens of a page.
_MOST_SCREENS = 60
# Height of a screen on which a page of a drive, which does not scroll, is shown
# [px].
_SCREEN = 850
_PICTURES = (".png", ".jpg", ".webp")
_THUMBNAIL = (520, 390)
# Height of the label above a picture [pixels].
_LABEL = 18
# Distance between pictures [pixels].
_GAP = 10
_SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_OPEN = 'document.querySelectorAll("details").forEach((one) => one.open = true)'
_IS_DRIVE = 'Boolean(document.getElementById("loading"))'
_LOADED = '!document.getElementById("loading")'
_PAUSE = "new Promise((done) => setTimeout(done, 3000))"
# Ticks the switch of a drive's page that shows what changed, if it has one.
_CHANGED = """[...document.querySelectorAll("label")]
  .filter((one) => one.textContent.includes("changed"))
  .forEach((one) => one.querySelector("input")?.click())"""


def main(sheets: Path, paths: Sequence[Path]) -> list[Path]:
    """Writes the contact sheets of pages and pictures; returns their paths."""
    sheets.mkdir(parents=True, exist_ok=True)
    files = [file for path in paths for file in _files(path)]
    written = []
    pages = [file for file in files if file.suffix == ".html"]
    with (
        tempfile.TemporaryDirectory() as profile,
        chromium(Path(profile), *_SOFTWARE) as browser,
    ):
        for page, width in itertools.product(pages, WIDTHS):
            screens = list(_screens(browser, page, width))
            stem = f"{page.parent.name}_{page.stem}_{width}"
            written += _write(sheets, stem, screens)
            for complaint in browser.complaints:
                print(f"{page}, {width} px: {complaint}")
    pictures = [_thumbnail(file) for file in files if file not in pages]
    return written + _write(sheets, "pictures", pictures)


def _files(path: Path) -> Iterator[Path]:
    kinds = (".html", *_PICTURES)
    inside = sorted(path.rglob("*")) if path.is_dir() else [path]
    # A figure's PNG shows what its other formats show.
    stems = {one.with_suffix("") for one in inside if one.suffix == ".png"}
    for file in inside:
        again = file.suffix == ".webp" and file.with_suffix("") in stems
        if file.suffix in kinds and not again:
            yield file


def _screens(browser: Browser, page: Path, width: int) -> Iterator[Image.Image]:
    """Yields pictures of a page's screens, from top to bottom."""
    height = _SHEET[1] - _LABEL
    browser.open(page.absolute().as_uri(), width, height)
    if browser.evaluate(_IS_DRIVE):
        browser.open(page.absolute().as_uri(), width, _SCREEN)
        browser.wait_for(_LOADED)
        for script in ("0", _CHANGED):
            browser.evaluate(script)
            browser.evaluate(_PAUSE)
            yield _named(_picture(browser), f"{page.name}, {width} px")
        return
    browser.evaluate(_OPEN)
    whole = int(browser.evaluate("document.documentElement.scrollHeight"))
    wide = int(browser.evaluate("document.documentElement.scrollWidth"))
    if wide > width:
        print(f"{page}, {width} px: {wide} px wide")
    for k, top in enumerate(range(0, whole, height)):
        if k == _MOST_SCREENS:
            print(f"{page}, {width} px: {whole - top} px left out")
            return
        browser.evaluate(f"window.scrollTo(0, {top})")
        shown = _picture(browser)
        # The last screen begins where the page allows it to.
        start = int(browser.evaluate("window.scrollY"))
        shown = shown.crop((0, top - start, width, height))
        yield _named(shown, f"{page.name}, {width} px, from {top} px on")


def _picture(browser: Browser) -> Image.Image:
    return Image.open(io.BytesIO(browser.picture())).convert("RGB")


def _thumbnail(file: Path) -> Image.Image:
    with Image.open(file) as picture:
        shown = picture.convert("RGB")
    shown.thumbnail(_THUMBNAIL)
    return _named(shown, f"{file.parent.name}/{file.name}")


def _named(picture: Image.Image, name: str) -> Image.Image:
    """Returns a picture below its name."""
    whole = Image.new("RGB", (picture.width, picture.height + _LABEL), "#ffd")
    whole.paste(picture, (0, _LABEL))
    ImageDraw.Draw(whole).text((2, 2), name, "black", ImageFont.load_default())
    return whole


def _write(
    sheets: Path, stem: str, pictures: Sequence[Image.Image]
) -> list[Path]:
    """Writes pictures from left to right and from top to bottom on sheets."""
    paths: list[Path] = []
    sheet = Image.new("RGB", _SHEET, "#888")
    x = y = line = 0

    def finish() -> None:
        paths.append(sheets / f"{stem}_{len(paths) + 1:02d}.png")
        sheet.crop((0, 0, _SHEET[0], y + line)).save(paths[-1])

    for picture in pictures:
        if x and x + picture.width > _SHEET[0]:
            x = 0
            y += line + _GAP
            line = 0
        if y and y + picture.height > _SHEET[1]:
            finish()
            sheet = Image.new("RGB", _SHEET, "#888")
            x = y = line = 0
        sheet.paste(picture, (x, y))
        x += picture.width + _GAP
        line = max(line, picture.height)
    if line:
        finish()
    return paths


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    for made in main(Path(sys.argv[1]), list(map(Path, sys.argv[2:]))):
        print(made)
