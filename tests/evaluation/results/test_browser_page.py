import base64
from dataclasses import replace
import io
from types import SimpleNamespace

from helpers.browser import chromium, has_chromium
from helpers.small_page import QUERIES, make_content
import numpy as np
from PIL import Image
import pytest

from evaluation.results import nearest_images

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not has_chromium(), reason="no chromium"),
]

# Sizes of a window [pixels].
PHONE = (390, 844)
DESKTOP = (1440, 900)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture(scope="module")
def content():
    pages = {"metropolis_04": "../pages/metropolis_04.html"}
    return make_content(pages=pages)


@pytest.fixture(scope="module")
def address(content, tmp_path_factory):
    return content.write(tmp_path_factory.mktemp("page")).as_uri()


@pytest.fixture
def reader(browser, address):
    """The page on a desktop, at the query browser."""
    browser.open(address, *DESKTOP)
    shown(browser, 0, 1, 0, 0)
    choose(browser, "method", "0")
    shown(browser, 0, 0, 0, 0)
    browser.evaluate('byId("browser").scrollIntoView({behavior: "instant"})')
    yield browser
    assert browser.complaints == []


def shown(browser, *state):
    """Waits until pair, method, query and rank have been drawn."""
    text = "/".join(map(str, state))
    browser.wait_for(f'document.body.dataset.shown === "{text}"')


def unfold(browser):
    browser.evaluate(
        'document.querySelectorAll("details.part")'
        ".forEach((one) => { one.open = true; })"
    )


def status(browser):
    return browser.evaluate('byId("status").textContent')


def choose(browser, name, value):
    browser.evaluate(
        f'byId("{name}").value = {value!r};'
        f' byId("{name}").dispatchEvent(new Event("change"))'
    )


def on_map(browser, content, x, y):
    """Returns the canvas position of a place in the world [m].

    The canvas shows the database's map and 10 m about the query's route,
    centred and as large as fits.
    """
    size = browser.evaluate(
        '[byId("map").clientWidth, byId("map").clientHeight]'
    )
    view = np.reshape(content.drives["metropolis_01"].extent, (2, 2))
    route = content.drives["metropolis_04"].route
    low = np.minimum(view[:, 0], route.min(axis=0) - 10.0)
    high = np.maximum(view[:, 1], route.max(axis=0) + 10.0)
    scale = np.min(size / (high - low))
    offset = scale * ([x, y] - (low + high) / 2.0)
    return size[0] / 2.0 + offset[0], size[1] / 2.0 - offset[1]


@pytest.mark.parametrize(
    ("size", "scheme"),
    [
        ((320, 600), "light"),
        (PHONE, "dark"),
        ((820, 1180), "light"),
        (DESKTOP, "dark"),
    ],
)
def test_page_fits_its_screen(browser, address, size, scheme):
    browser.open(address, *size, scheme)
    shown(browser, 0, 1, 0, 0)
    unfold(browser)
    width = browser.evaluate("document.scrollingElement.scrollWidth")
    assert width <= size[0]
    assert browser.complaints == []
    # Only elements that scroll by themselves are wider than the page.
    assert not browser.evaluate(
        """[...document.querySelectorAll("body *")].filter((one) =>
          one.getBoundingClientRect().right > innerWidth + 1 &&
          !one.closest(".scrolling, nav")).map((one) => one.outerHTML)"""
    )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out(browser, address, scheme):
    browser.open(address, *PHONE, scheme)
    shown(browser, 0, 1, 0, 0)
    ratios = browser.evaluate(
        """(() => {
          const parse = (text) => text.match(/[\\d.]+/g).map(Number);
          const light = (rgb) => {
            const [r, g, b] = rgb.slice(0, 3).map((v) => v / 255).map((v) =>
              v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
            return 0.2126 * r + 0.7152 * g + 0.0722 * b;
          };
          const ground = (one) => {
            for (let e = one; e; e = e.parentElement) {
              const rgba = parse(getComputedStyle(e).backgroundColor);
              if (rgba.length === 3 || rgba[3] === 1) return rgba;
            }
            return [255, 255, 255];
          };
          return [...document.querySelectorAll(
            "h1, h2, p, a, td, th, dt, dd, .verdict, figcaption, summary," +
            " #status span")].map((one) => {
              const a = light(parse(getComputedStyle(one).color));
              const b = light(ground(one));
              return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
            });
        })()"""
    )
    # WCAG 2.2, 1.4.3, level AA.
    assert len(ratios) > 40
    assert min(ratios) >= 4.5


def test_a_link_unfolds_its_section(browser, address):
    browser.open(address, *PHONE)
    folded = (
        '[...document.querySelectorAll("details.part:not([open])")]'
        ".map((one) => one.parentElement.id)"
    )
    names = browser.evaluate(folded)
    assert names == ["routes", "change", "conditions", "made_by"]
    link = "document.querySelector(\"nav a[href='#routes']\")"
    browser.evaluate(f"{link}.click()")
    names.remove("routes")
    assert browser.evaluate(folded) == names


def test_fingers_hit(browser, address):
    browser.open(address, *PHONE)
    shown(browser, 0, 1, 0, 0)
    unfold(browser)
    low = browser.evaluate(
        """[...document.querySelectorAll(
          "a, button, select, summary, label, input[type=range]")]
          .filter((one) => one.checkVisibility() &&
            one.getBoundingClientRect().height < 40)
          .map((one) => one.outerHTML)"""
    )
    assert low == []


def test_slider_and_keys(reader):
    assert status(reader).startswith(
        "Query 1 of 5, Scan Context++: right – top-ranked place 2.0 m away,"
        " score 0.9000"
    )
    reader.press("ArrowRight")
    shown(reader, 0, 0, 1, 0)
    # From (10, 2) to (45, 0).
    assert status(reader).startswith(
        "Query 2 of 5, Scan Context++: wrong – top-ranked place 35.1 m"
    )
    reader.evaluate('byId("query").focus()')
    for key, query in (("ArrowRight", 2), ("ArrowLeft", 1)):
        reader.press(key)
        shown(reader, 0, 0, query, 0)
    reader.evaluate(
        'byId("query").value = 4;'
        ' byId("query").dispatchEvent(new Event("input"))'
    )
    shown(reader, 0, 0, 4, 0)
    assert "no match" in status(reader)
    # At the last query it stays there.
    reader.press("ArrowRight")
    reader.evaluate('byId("next").click()')
    assert reader.evaluate("state.query") == 4
    reader.evaluate('byId("previous").click()')
    shown(reader, 0, 0, 3, 0)


def test_keys_leave_other_sections_alone(browser, address):
    browser.open(address, *PHONE)
    shown(browser, 0, 1, 0, 0)
    # The browser is out of sight, below other sections.
    browser.evaluate(
        'document.body.insertAdjacentHTML("afterbegin",'
        ' "<div style=height:3000px></div>")'
    )
    browser.press("ArrowRight")
    assert browser.evaluate("state.query") == 0
    browser.evaluate('byId("browser").scrollIntoView({behavior: "instant"})')
    browser.evaluate('document.querySelector("#browser .scrolling").focus()')
    browser.press("ArrowRight")
    assert browser.evaluate("state.query") == 0


def test_click_on_the_map(reader, content):
    left, top = reader.evaluate(
        '(({x, y}) => [x, y])(byId("map").getBoundingClientRect())'
    )
    for query in (3, 0):
        x, y = on_map(reader, content, QUERIES[query], 2.0)
        reader.click(left + x + 3, top + y - 9)
        shown(reader, 0, 0, query, 0)


def test_click_on_the_strip(reader):
    x, y = reader.evaluate(
        """(() => { const box = byId("strip").getBoundingClientRect();
          return [box.x + 0.5 * box.width, box.y + 5]; })()"""
    )
    reader.click(x, y)
    shown(reader, 0, 0, 2, 0)
    assert status(reader) == "Query 3 of 5, Scan Context++: no candidate"


def test_only_wrong_ones(reader):
    choose(reader, "filter", "wrong")
    shown(reader, 0, 0, 1, 0)
    assert reader.evaluate('byId("filtered").value') == "1 of 5"
    reader.press("ArrowRight")
    assert reader.evaluate("state.query") == 1
    # The other method is wrong on another query.
    choose(reader, "method", "1")
    shown(reader, 0, 1, 3, 0)
    assert "RING++: wrong" in status(reader)
    choose(reader, "filter", "right")
    shown(reader, 0, 1, 2, 0)
    assert reader.evaluate('byId("filtered").value') == "3 of 5"
    choose(reader, "filter", "silent")
    assert reader.evaluate('byId("filtered").value') == "0 of 5"
    reader.press("ArrowLeft")
    assert reader.evaluate("state.query") == 2
    choose(reader, "filter", "alone")
    assert reader.evaluate('byId("filtered").value') == "2 of 5"
    choose(reader, "filter", "all")
    assert reader.evaluate('byId("filtered").value') == "5 of 5"


def test_only_those_of_one_reason(reader):
    choose(reader, "why", "elsewhere")
    shown(reader, 0, 0, 1, 0)
    assert reader.evaluate('byId("filtered").value') == "1 of 5"
    assert status(reader).endswith(" – elsewhere")
    choose(reader, "filter", "right")
    assert reader.evaluate('byId("filtered").value') == "0 of 5"
    choose(reader, "why", "")
    choose(reader, "filter", "none")
    shown(reader, 0, 0, 4, 0)
    assert status(reader).startswith("Query 5 of 5, Scan Context++: no match")
    choose(reader, "filter", "all")
    assert reader.evaluate('byId("filtered").value') == "5 of 5"


def test_no_query_is_shown_if_none_fits(reader):
    parts = """["#no-query", ".views", ".steering", ".lists"].map(
      (name) => document.querySelector(name).offsetHeight > 0)"""
    assert reader.evaluate(parts) == [False, True, True, True]
    choose(reader, "why", "near_miss")
    assert reader.evaluate('byId("filtered").value') == "0 of 5"
    assert reader.evaluate(parts) == [True, False, False, False]
    assert status(reader) == ""
    choose(reader, "why", "")
    assert reader.evaluate(parts) == [False, True, True, True]
    shown(reader, 0, 0, 0, 0)
    assert (pixels(reader, "map") < 128).any()


def test_the_legend_of_the_map_has_its_marks(reader):
    kinds = reader.evaluate(
        """[...document.querySelectorAll("figure.map .key")].map(
          (key) => [key.tagName, key.classList[1]])"""
    )
    assert ["svg", "query"] in kinds
    assert ["svg", "wrong"] in kinds
    assert len(kinds) == 7


def test_verdicts_of_all_methods(reader):
    reader.press("ArrowRight")
    shown(reader, 0, 0, 1, 0)
    rows = reader.evaluate(
        '[...byId("all-methods").tBodies[0].rows].map((row) =>'
        " [...row.cells].map((cell) => cell.textContent))"
    )
    assert rows == [
        ["Scan Context++", "✗ wrong", "35.1 m", "3"],
        ["RING++", "✓ right", "2.0 m", "1"],
    ]
    reader.evaluate('byId("all-methods").querySelectorAll("button")[1].focus()')
    reader.press(" ")
    shown(reader, 0, 1, 1, 0)
    # The rows are new elements, and the focus is kept.
    assert reader.evaluate("document.activeElement.textContent") == "RING++"
    assert reader.evaluate('byId("method").value') == "1"


def test_other_places_and_pairs(reader):
    reader.evaluate('byId("best").tBodies[0].rows[2].click()')
    shown(reader, 0, 0, 0, 2)
    caption = 'byId("match-caption").textContent'
    assert reader.evaluate(caption) == "Place 3: metropolis_01, frame 2 "
    reader.press("ArrowRight")
    shown(reader, 0, 0, 1, 0)
    choose(reader, "pair", "1")
    shown(reader, 1, 0, 0, 0)
    assert status(reader).startswith("Query 1 of 10, RING++: right")
    assert reader.evaluate('byId("query").max') == "9"


def test_a_pair_opens_at_a_query_that_has_a_place(reader):
    reader.evaluate("data.pairs[1].matches[0] = data.pairs[1].matches[1] = []")
    choose(reader, "pair", "1")
    shown(reader, 1, 0, 2, 0)
    assert "Query 3 of 10" in status(reader)


def test_address_leads_to_a_query(reader, address):
    choose(reader, "method", "1")
    reader.press("ArrowRight")
    reader.press("ArrowRight")
    fragment = "#query/metropolis_01/metropolis_04/ring%2B%2B/2"
    reader.wait_for(f"location.hash === {fragment!r}")
    for size in (PHONE, DESKTOP):
        reader.open(address + fragment, *size)
        shown(reader, 0, 1, 2, 0)
        assert status(reader).startswith("Query 3 of 5, RING++: right")
        top = 'byId("browser").getBoundingClientRect().top'
        assert abs(reader.evaluate(top)) < 100
    reader.evaluate(
        'location.hash = "#query/metropolis_04/metropolis_01/ring%2B%2B/7"'
    )
    shown(reader, 1, 0, 7, 0)


@pytest.mark.parametrize(
    "fragment",
    [
        "#maps",
        "#query/%/%/%/%",
        "#query/metropolis_01",
    ],
)
def test_addresses_that_lead_nowhere(browser, address, fragment):
    """The page then shows the best method, RING++."""
    browser.open(address + fragment, *DESKTOP)
    shown(browser, 0, 1, 0, 0)
    assert browser.complaints == []


@pytest.mark.parametrize("fragment", ["unknown/no-number", "ring/999"])
def test_addresses_that_lead_to_a_pair(browser, address, fragment):
    pair = "#query/metropolis_01/metropolis_04/"
    browser.open(address + pair + fragment, *DESKTOP)
    shown(browser, 0, 0, 0, 0)
    assert browser.complaints == []


@pytest.mark.parametrize("size", [PHONE, DESKTOP])
def test_images_of_query_and_match(browser, content, tmp_path, size):
    images = []
    for number in range(3):
        stream = io.BytesIO()
        Image.new("RGB", (300 + number, 240)).save(stream, "JPEG")
        images.append(stream.getvalue())
    drives = {}
    for k, (name, drive) in enumerate(sorted(content.drives.items())):
        camera = SimpleNamespace(
            name=name,
            image_stamps_ns=np.array([0, 4]),
            image=images[k : k + 2].__getitem__,
        )
        stamps_ns = np.arange(len(drive.frames))
        drives[name] = replace(
            drive, images=nearest_images(camera, stamps_ns, pytest.fail)
        )
    path = replace(content, drives=drives).write(tmp_path)
    browser.open(path.as_uri(), *size)
    shown(browser, 0, 1, 0, 0)
    choose(browser, "method", "0")
    browser.evaluate('byId("browser").scrollIntoView({behavior: "instant"})')
    widths = []
    for query in range(3):
        shown(browser, 0, 0, query, 0)
        widths.append(
            browser.evaluate(
                """Promise.all(["query", "match"]
                  .map((id) => byId(id + "-image"))
                  .map((one) => !one.checkVisibility() ? 0 :
                    one.decode().then(() => one.naturalWidth)))"""
            )
        )
        browser.press("ArrowRight")
    # Scan Context++ takes places 0 and 9, and has no candidate for the third.
    assert widths == [[301, 300], [301, 301], [301, 0]]
    wide = browser.evaluate("document.scrollingElement.scrollWidth")
    assert wide <= size[0]
    assert browser.complaints == []


def test_links_to_recordings(reader):
    links = (
        "[...document.querySelectorAll('{} a')].map((a) => [a.text, a.href])"
    )
    for place in ("#routes", "#query-caption"):
        ((text, href),) = reader.evaluate(links.format(place))
        assert text == "look around in 3-D"
        assert href.endswith("/pages/metropolis_04.html")
    # The other drive has no page.
    assert reader.evaluate(links.format("#match-caption")) == []


def test_print_fits_its_paper(browser, address):
    # The width of A4 less its margins.
    browser.open(address, 718, 1000, media="print")
    shown(browser, 0, 1, 0, 0)
    # The table of all numbers is too long and stays folded.
    wide = browser.evaluate(
        """[...document.querySelectorAll("h2, p, img, svg, table")]
          .filter((one) => one.checkVisibility() && !one.closest("details") &&
            one.getBoundingClientRect().right > innerWidth)
          .map((one) => one.outerHTML)"""
    )
    assert wide == []
    assert not browser.evaluate('byId("browser").checkVisibility()')


def test_full_size(browser, address):
    browser.open(address, *PHONE)
    unfold(browser)
    figures = browser.evaluate('document.querySelectorAll(".enlarge").length')
    assert figures == 3
    for index in range(figures):
        browser.evaluate(
            f'document.querySelectorAll(".enlarge input")[{index}].focus()'
        )
        box = (
            f'(() => {{ const box = document.querySelectorAll("figure'
            f' .scrolling")[{index}]; const edges ='
            " box.getBoundingClientRect(); return [edges.width, edges.height,"
            " box.firstElementChild.getBoundingClientRect().width]; })()"
        )
        before = browser.evaluate(box)
        browser.press(" ")
        width, height, inner = browser.evaluate(box)
        assert [width, height] == list(PHONE)
        assert inner >= 1100
        browser.press("Escape")
        assert browser.evaluate(box) == before
    assert browser.complaints == []


def pixels(browser, name):
    """Returns a canvas as (height, width, 3)."""
    url = browser.evaluate(f'byId("{name}").toDataURL()')
    data = base64.b64decode(url.split(",")[1])
    picture = Image.open(io.BytesIO(data)).convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")
    return np.array(Image.alpha_composite(white, picture).convert("RGB"), int)


def test_scan_and_match_are_drawn(reader, content):
    reader.press("ArrowRight")
    shown(reader, 0, 0, 1, 0)
    # The wall is 20.25 m in front of a vehicle that drives up.
    scan = pixels(reader, "query-scan")
    rows, columns = np.nonzero(scan[..., 2] > scan[..., 0] + 30)
    height, width = scan.shape[:2]
    scale = height / 100.0
    assert 0.5 * height - rows.mean() == pytest.approx(20.25 * scale, abs=2)
    assert columns.mean() == pytest.approx(0.5 * width, abs=2)
    assert np.ptp(columns) == pytest.approx(18.0 * scale, abs=4)
    # The match, in orange, is where the database has it.
    seen = pixels(reader, "map")
    rows, columns = np.nonzero((np.abs(seen - [230, 159, 0]) < 12).all(axis=2))
    assert len(rows) > 40
    assert (columns.mean(), rows.mean()) == pytest.approx(
        on_map(reader, content, 45.0, 0.0), abs=1.5
    )
