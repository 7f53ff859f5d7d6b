"""The page of a drive in a browser."""

import json
import re

from helpers.browser import chromium, has_chromium
from helpers.scripted_car import film, scan_of
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
import pytest

from cns_drake import load_scenario
from cns_drake.pictures import ShownStages, read_drive_page
from cns_drake.recording import FRAME_PERIOD
from cns_drake.scenarios import DrivePlan
from cns_drake.scene import load_world
from cns_drake.simulation import load_drive
from evaluation.base import InputError

PERIOD = 0.5
NUM_FRAMES = 21
SCREENS = {"desktop": (1440, 900), "laptop": (1200, 750), "phone": (390, 844)}
VEHICLE = """<sdf version="1.9"><model name="vehicle"><link name="base_link">
<visual name="body"><geometry><box><size>4 2 1</size></box></geometry></visual>
</link></model></sdf>"""


def visual(name, place, size, rgb):
    return (
        f'<visual name="{name}"><pose>{place} 0 0 0</pose><geometry><box>'
        f"<size>{size}</size></box></geometry><material><diffuse>{rgb} 1"
        "</diffuse></material></visual>"
    )


GROUND = visual("ground/slab", "0 0 -0.1", "80 80 0.2", "0.4 0.5 0.3")
HALL = visual("hall/wall", "-15 12 3", "8 4 6", "0.8 0.5 0.2")
HIGHER_HALL = visual("hall/wall", "-15 12 6", "8 4 12", "0.8 0.5 0.2")
KIOSK = visual("kiosk/wall", "12 -12 2", "4 4 4", "0.2 0.6 0.3")
TOWER = visual("tower/wall", "15 15 10", "6 6 20", "0.7 0.7 0.7")


def stage(folder, name, *visuals, **arguments):
    path = folder / f"{name}.sdf"
    path.write_text(
        '<sdf version="1.9"><world name="w"><model name="town">'
        f'<static>true</static><link name="city">{"".join(visuals)}</link>'
        "</model></world></sdf>"
    )
    return load_world(path, **arguments)


def X_WB_at(frame):
    """A left turn of 90 degrees on the way."""
    yaw = np.pi / 2 * frame / (NUM_FRAMES - 1)
    place = [20.0 * np.sin(yaw), 20.0 * (1.0 - np.cos(yaw)), 0.5]
    return RigidTransform(RollPitchYaw(0.0, 0.0, yaw), place)


def points_of(frame):
    """Points on all sides, some of them far away."""
    rng = np.random.default_rng(frame)
    return X_WB_at(frame).translation() + rng.normal(scale=90.0, size=(500, 3))


def scan_at(time):
    frame = round(time / PERIOD)
    return scan_of((X_WB_at(frame).inverse() @ points_of(frame).T).T)


def film_town(folder, other_stage=None):
    """A drive through a town, filmed; the LiDAR is at the vehicle's origin."""
    vehicle = folder / "vehicle.sdf"
    vehicle.write_text(VEHICLE)
    return film(
        stage(folder, "here", GROUND, HALL, KIOSK, vehicle=vehicle),
        lambda time: X_WB_at(time / PERIOD),
        lambda time: (0.0, 0.0, 0.1, 0.5 * time / PERIOD, 0.0, 0.0),
        lambda time: ((0.1, 0.2, 9.81), (0.0, 0.0, 0.1)),
        {"lidar": scan_at},
        NUM_FRAMES,
        period=PERIOD,
        X_BSs={"lidar": RigidTransform()},
        shown=ShownStages(
            other_stage, "stage <02>", False, "01", ("01", "02"), "a & b"
        ),
        sensors=("lidar: cns, 32 rings",),
    )


def write_page(path, other_stage=None, title="a < b", **options):
    film_town(path.parent, other_stage).save(path, title=title, **options)
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    other = stage(folder, "there", GROUND, HIGHER_HALL, TOWER)
    return write_page(folder / "page.html", other)


def test_page_has_title_length_and_legend(page):
    text = page.read_text()
    assert "<title>a &lt; b</title>" in text
    assert "<h1>a &lt; b</h1>" in text
    # A quarter of a circle of 20 m, in 20 steps of half a second.
    assert "<p>31 m in 10 s</p>" in text
    for line in ("gone after stage 01", "new in stage &lt;02&gt;"):
        assert f"</i> {line}</span>" in text
    for line in (
        "lidar: cns, 32 rings",
        "LiDAR: the last 3 s, every scan, up to 500 points a scan",
    ):
        assert f"<p>{line}</p>" in text
    assert not re.search(r"\{\{\w+\}\}", text)


def test_page_says_that_it_loads_before_the_city_comes(page):
    text = page.read_text()
    assert "Loading the city" in text[: text.index("<script")]


def test_page_of_another_city_is_refused(page, tmp_path):
    assert read_drive_page(page, "a & b").title == "a < b"
    with pytest.raises(InputError, match="a drive through a & b, not town"):
        read_drive_page(page, "town")
    page = tmp_path / "other.html"
    page.write_text("<h1>Other</h1>")
    with pytest.raises(InputError, match="html: not the page of a drive"):
        read_drive_page(page, "town")


def test_without_another_stage_nothing_is_said_of_change(tmp_path):
    text = write_page(tmp_path / "page.html").read_text()
    for name in ('id="change"', 'value="change"', 'id="divider"', "Changes<"):
        assert name not in text


@pytest.mark.slow
@pytest.mark.night
def test_page_of_a_shipped_drive_is_small(tmp_path):
    """With scans that are hard to compress."""
    scenario = load_scenario("downtown_01")  # It has the largest page.
    loaded = load_drive(DrivePlan(scenario))
    rng = np.random.default_rng(0)

    def noisy_scan(time):
        scan = scan_of(rng.normal(scale=30.0, size=(25_000, 3)))
        scan["ring"] = np.repeat(np.arange(25), 1000)
        return scan

    recorder = film(
        loaded.world,
        loaded.trajectory.pose,
        lambda time: rng.normal(size=6),
        lambda time: rng.normal(size=(2, 3)),
        {"lidar": noisy_scan},
        loaded.num_frames,
        period=FRAME_PERIOD,
        X_BSs={"lidar": RigidTransform()},
        shown=ShownStages(load_world(scenario.folder.stage("04"))),
    )
    path = tmp_path / "page.html"
    recorder.save(path)
    # Scans are left out evenly, so some room is left.
    assert 15e6 < path.stat().st_size <= 20e6
    assert re.search(
        r"one scan in \d+, up to 25,000 points a scan<", path.read_text()
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    profile = tmp_path_factory.mktemp("profile")
    software = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    # The test may look into the frames of a page.
    with chromium(
        profile, *software, "--allow-file-access-from-files"
    ) as browser:
        yield browser


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(
            size, id=name, marks=pytest.mark.night if name == "laptop" else ()
        )
        for name, size in SCREENS.items()
    ],
)
def opened(browser, page, request):
    """The page, standing still, with its panels unfolded."""
    browser.open(page.as_uri(), *request.param)
    # Nobody looks at the picture, which software draws pixel by pixel.
    browser.evaluate("viewer.renderer.setPixelRatio(0.1)")
    browser.wait_for('!document.getElementById("loading")')
    browser.evaluate("viewer.animator.pause()")
    browser.evaluate("document.getElementById('follow').click()")
    browser.evaluate("viewer.controls.saveState()")
    assert browser.evaluate('document.body.classList.contains("folded")')
    assert browser.evaluate("document.getElementById('plots').hidden")
    # It opens between both stages.
    assert (
        browser.evaluate("document.getElementById('divider').hidden") is False
    )
    for name in ("change", "fold", "unfold"):
        browser.evaluate(f"document.getElementById('{name}').click()")
    return browser


@pytest.fixture
def pair(browser, tmp_path):
    """A page of two drives, both standing still."""
    first = write_page(tmp_path / "first.html", title="first")
    path = write_page(
        tmp_path / "pair.html",
        title="second",
        beside=read_drive_page(first, "a & b"),
    )
    # Tests look into the frames, which have an origin of their own.
    text = path.read_text()
    assert text.count(SANDBOX) == 2
    path.write_text(text.replace(SANDBOX, ""))
    browser.open(path.as_uri(), 1440, 900)
    for k in range(2):
        browser.wait_for(inside(k, "typeof commands !== 'undefined'"))
        browser.evaluate(inside(k, "viewer.renderer.setPixelRatio(0.1)"))
        browser.wait_for(inside(k, '!document.getElementById("loading")'))
        browser.evaluate(inside(k, "viewer.animator.pause()"))
    return browser


CLOUDS = "viewer.scene_tree.find(['scans']).object.children[0].children"


def of_hex(colour):
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


SANDBOX = 'sandbox="allow-scripts"'
TAKE = "<script>parent.document.title = 'taken'</script><h1>"


# A software renderer takes half a minute.
@pytest.mark.night
@pytest.mark.slow
@pytest.mark.skipif(not has_chromium(), reason="no chromium")
def test_a_page_of_others_runs_in_a_frame_of_its_own(browser, tmp_path):
    path = write_page(tmp_path / "page.html")
    path.write_text(path.read_text().replace("<h1>", TAKE, 1))
    path = write_page(
        tmp_path / "pair.html", beside=read_drive_page(path, "a & b")
    )
    browser.open(path.as_uri(), 1440, 900)
    # The first drive, whose script has run by then, still leads the second.
    browser.evaluate("new Promise((heard) => { onmessage = heard; })")
    assert browser.evaluate("document.title") != "taken"


def inside(k, expression):
    """The expression in one of the two pages, which are frames."""
    return f"window[{k}].eval({json.dumps(expression)})"


@pytest.fixture
def reader(opened):
    """The page at the drive's start; tests leave its buttons as they were."""
    browser = opened
    browser.evaluate("viewer.controls.reset()")
    go_to(browser, 0.0)
    yield browser
    # Software renderers warn of their own slowness.
    assert not [c for c in browser.complaints if "'rendering'" not in c]


def click(browser, name):
    """Clicks at the visible position of a button, which is scrolled there."""
    x, y = browser.evaluate(
        f"""(() => {{
          const button = document.getElementById("{name}");
          button.scrollIntoView({{block: "nearest"}});
          const box = button.getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2];
        }})()"""
    )
    browser.click(x, y)


def go_to(browser, time):
    """Moves the slider to a time [s], and draws the picture."""
    browser.evaluate(
        f"""(() => {{
          const slider = document.getElementById("time");
          slider.value = {time};
          slider.dispatchEvent(new Event("input"));
          viewer.render();
        }})()"""
    )


def choose(browser, value):
    """Chooses what gives points their colour."""
    browser.evaluate(
        f"""(() => {{
          const menu = document.getElementById("points");
          menu.value = "{value}";
          menu.dispatchEvent(new Event("change"));
        }})()"""
    )


def is_visible(browser, *path):
    find = f"viewer.scene_tree.find({json.dumps(path)})"
    return browser.evaluate(f"{find}.object.visible")


def p_WC(browser):
    """Returns where the camera is [m]."""
    x, y, z = browser.evaluate("viewer.camera.position.toArray()")
    return np.array([x, -z, y])  # In three.js y is up.


slow_in_chromium = [
    pytest.mark.slow,
    pytest.mark.skipif(not has_chromium(), reason="no chromium"),
]


# A ray from 1 m above the car to the camera is 6.96 m high where a wall, which
# counts a cell wider, begins.
@pytest.mark.slow
@pytest.mark.skipif(not has_chromium(), reason="no chromium")
@pytest.mark.parametrize("height", [6.9, 7.02, 15.0])
def test_camera_rises_over_a_wall_that_hides_the_car(browser, tmp_path, height):
    vehicle = tmp_path / "vehicle.sdf"
    vehicle.write_text(VEHICLE)
    place, size = f"-12 0 {height / 2}", f"1 20 {height}"
    wall = visual("house/wall", place, size, "0.7 0.7 0.7")
    world = stage(tmp_path, "here", GROUND, wall, vehicle=vehicle)
    X_WBs = [RigidTransform([3.0 * k, 0.0, 0.5]) for k in range(NUM_FRAMES)]
    recorder = film(
        world,
        lambda time: X_WBs[round(time / PERIOD)],
        lambda time: np.zeros(6),
        lambda time: np.zeros((2, 3)),
        {},
        NUM_FRAMES,
        period=PERIOD,
        X_BSs={},
    )
    path = tmp_path / "page.html"
    recorder.save(path)
    browser.open(path.as_uri(), *SCREENS["desktop"])
    browser.evaluate("viewer.renderer.setPixelRatio(0.1)")
    browser.wait_for('!document.getElementById("loading")')
    browser.evaluate("viewer.animator.pause()")
    usual = [-25.0, 0.0, 14.0]
    go_to(browser, 10.0)
    p_WB = X_WBs[-1].translation()
    np.testing.assert_allclose(p_WC(browser) - p_WB, usual, atol=1e-3)
    go_to(browser, 0.0)
    p_WB = X_WBs[0].translation()
    x, y, z = p_BC = p_WC(browser) - p_WB
    assert abs(y) < 1e-3
    assert bool(z > 14.01) is (height > 6.96)
    # Its distance from what it looks at stays.
    target = np.array([5.0, 0.0, 0.0])
    away = np.linalg.norm([usual - target, p_BC - target], axis=1)
    assert away[0] == pytest.approx(away[1], abs=1e-3)
    # The whole wall is below the line of sight.
    for edge in (-11.5, -12.5):
        assert x > edge or p_WB[2] + z * edge / x > height
    # If the user looks from higher up, less of a rise is needed.
    browser.evaluate("viewer.camera.position.y += 0.5; viewer.render()")
    z_now = p_WC(browser)[2] - p_WB[2]
    assert z_now == pytest.approx(max(z, usual[2] + 0.5), abs=0.4)
    assert not [c for c in browser.complaints if "'rendering'" not in c]


# A software renderer takes minutes to draw two cities.
@pytest.mark.night
@pytest.mark.slow
@pytest.mark.skipif(not has_chromium(), reason="no chromium")
@pytest.mark.parametrize("leader", [0, 1])
def test_one_drive_follows_the_other_to_its_place(pair, leader):
    follower = 1 - leader
    pair.click(360 + 720 * leader, 300)
    pair.evaluate(
        inside(
            leader,
            """(() => {
              const slider = document.getElementById("time");
              slider.value = 6;
              slider.dispatchEvent(new Event("input"));
              viewer.render();
            })()""",
        )
    )
    pair.wait_for(inside(follower, "viewer.animator.time") + " === 6")
    # The camera follows the car when a picture is drawn.
    pair.evaluate(inside(follower, "viewer.render()"))
    cameras = [
        pair.evaluate(inside(k, "viewer.camera.position.toArray()"))
        for k in range(2)
    ]
    np.testing.assert_allclose(*cameras, atol=1e-4)
    assert not [c for c in pair.complaints if "'rendering'" not in c]


@pytest.mark.usefixtures("reader")
class TestInChromium:
    pytestmark = slow_in_chromium

    def test_panels_fit_the_screen(self, reader):
        """Unfolded, too; on a phone they are one sheet, which is scrolled."""
        assert not reader.evaluate(
            """[...document.querySelectorAll(".panel, .panel *")].filter(
              (one) => {
                const box = one.getBoundingClientRect();
                return box.left < 0 || box.right > innerWidth ||
                  (innerWidth > 640 &&
                    (box.top < 0 || box.bottom > innerHeight));
              }).map((one) => one.outerHTML)"""
        )
        shares = reader.evaluate(
            """["sheet", "bar"].map((id) => {
              const {width, height} = document.getElementById(id)
                .getBoundingClientRect();
              return width * height / innerWidth / innerHeight;
            })"""
        )
        is_phone = reader.evaluate("innerWidth") <= 640
        assert shares[not is_phone] < 1 / 3

    def test_bar_comes_when_the_city_is_there(self, reader):
        is_seen = (
            'document.getElementById("bar")'
            ".checkVisibility({visibilityProperty: true})"
        )
        assert reader.evaluate(is_seen) is True
        reader.evaluate(
            'document.body.insertAdjacentHTML("afterbegin",'
            " \"<div id='loading'></div>\")"
        )
        assert reader.evaluate(is_seen) is False
        reader.evaluate('document.getElementById("loading").remove()')
        assert reader.evaluate(is_seen) is True

    def test_sides_of_the_divider_show_both_stages(self, reader):
        legend = 'document.getElementById("outlines").checkVisibility()'
        shown = """(() => {
          const seen = [];
          const layer = (name) => viewer.scene_tree.find([name]).object;
          const draw = viewer.renderer.renderBufferDirect;
          layer("before").children[0].children[0].onBeforeRender =
            () => seen.push("before");
          layer("after").children[0].children[0].onBeforeRender =
            () => seen.push("after");
          viewer.render();
          return seen;
        })()"""
        # The mesh has its own colours, and four copies behind it.
        mesh = (
            'viewer.scene_tree.find(["after", "unlabeled", "<object>"]).object'
        )
        after = reader.evaluate(
            'document.getElementById("divider").dataset.after'
        )
        for is_on in (False, True, False):
            sides = ["before", "after"] if is_on else ["before"]
            assert reader.evaluate(shown) == sides
            assert reader.evaluate(legend) is is_on
            colour = reader.evaluate(f"{mesh}.material.color.getHexString()")
            assert colour == "ffffff"
            assert (
                reader.evaluate(
                    f"{mesh}.children.filter(({{visible}}) => visible).map("
                    "({material}) => '#' +"
                    " material.uniforms.colour.value.getHexString())"
                )
                == [after] * 4 * is_on
            )
            click(reader, "change")
        # Its handle is dragged.
        x, y, quarter = reader.evaluate(
            """(() => {
              const {x, y} = document.querySelector("#divider i")
                .getBoundingClientRect();
              return [x + 22, y + 22, innerWidth / 4];
            })()"""
        )
        reader.drag((x, y), (quarter, y + 30))
        place = "parseFloat(document.getElementById('divider').style.left)"
        assert reader.evaluate(place) == pytest.approx(25.0)
        click(reader, "change")

    @pytest.mark.parametrize("frame", [0, 4, 20])
    def test_scans_of_three_seconds_are_shown_with_every_point(
        self, reader, frame
    ):
        go_to(reader, frame * PERIOD)
        frames = range(max(frame - 5, 0), frame + 1)
        reader.wait_for(
            f"(viewer.render(), {CLOUDS}.filter("
            f"({{visible}}) => visible).length === {len(frames)})"
        )
        seen = reader.evaluate(
            f"{CLOUDS}.filter(({{visible}}) => visible).map(({{geometry}}) => "
            "[...geometry.attributes.position.array])"
        )
        seen = [np.reshape(one, (-1, 3)) for one in seen]
        for k in frames:
            cloud = min(seen, key=lambda one: abs(one - points_of(k)).max())
            np.testing.assert_allclose(cloud, points_of(k), atol=0.0101)

    def test_points_are_coloured_by_what_is_chosen(self, reader):
        go_to(reader, 0.0)
        reader.wait_for(f"(viewer.render(), {CLOUDS}.length > 0)")
        scales = reader.evaluate(
            "Object.fromEntries([...document.getElementById('points').options]"
            ".map(({value, dataset}) => [value, dataset.colours]))"
        )
        rgb = {}
        for mode in ("height", "intensity", "class", "change"):
            choose(reader, mode)
            colours = reader.evaluate(
                f"[...{CLOUDS}.find(({{userData}}) => Math.abs("
                f"userData.points[0] - ({points_of(0)[0, 0]})) < 0.02)"
                ".geometry.attributes.color.array]"
            )
            linear = np.reshape(colours, (-1, 3))
            rgb[mode] = np.where(
                linear < 0.0031308,
                12.92 * linear,
                1.055 * linear ** (1 / 2.4) - 0.055,
            )
            shown = reader.evaluate(
                "[...document.querySelectorAll('.key')].filter("
                "(key) => key.checkVisibility()).map(({dataset}) => dataset.of)"
            )
            assert shown == [mode]
        choose(reader, "height")
        z = points_of(0)[:, 2]
        level = np.clip(z / 25.0, 0, 1)
        # Between the colours of the scale, by their light.
        for k, end in ((0, level == 0.0), (-1, level == 1.0)):
            colour = scales["height"].split(",")[k]
            np.testing.assert_allclose(
                rgb["height"][end], [of_hex(colour)] * end.sum(), atol=0.01
            )
        # All points have intensity 0, no class, and an unknown structure.
        for mode in ("intensity", "class", "change"):
            first = of_hex(scales[mode].split(",")[0])
            np.testing.assert_allclose(rgb[mode], [first] * 500, atol=0.01)

    def test_buttons_go_to_the_changes(self, reader):
        """The tower at (15, 15) is the greatest; the kiosk is near it."""
        button = "document.querySelector('#places [data-time]')"
        told = reader.evaluate(f"{button}.title")
        assert told == "Tower, 20 m high, new in stage <02>"
        go_to(reader, 10.0)
        shown = "document.getElementById('place').value"
        assert reader.evaluate(shown) == ""
        reader.evaluate(f"{button}.click()")
        reader.evaluate("viewer.render()")
        assert reader.evaluate("viewer.animator.time") == 0.0
        assert reader.evaluate(shown) == told
        assert reader.evaluate(f"{button}.ariaCurrent") == "true"
        # The camera, the car and the tower are on a line.
        x, y, _ = p_WC(reader)
        assert x == pytest.approx(y)
        assert x < 0.0
        # The divider has the later stage on its right.
        share = "parseFloat(document.getElementById('divider').style.left)"
        assert reader.evaluate(share) == pytest.approx(35.0)
        label = "document.getElementById('follow').textContent"
        assert reader.evaluate(label) == "Whole city"
        click(reader, "follow")
        assert reader.evaluate(label) == "Back to the car"

    def test_camera_follows_the_car(self, reader):
        before = p_WC(reader)
        click(reader, "follow")
        p_BCs = []
        for time in (0.0, 2.5, 10.0):
            go_to(reader, time)
            X_WB = X_WB_at(round(time / PERIOD))
            p_BCs.append(X_WB.inverse() @ p_WC(reader))
        # The camera is always behind the car and above it.
        assert p_BCs[0][0] < -5.0
        assert abs(p_BCs[0][1]) < 1e-6
        assert p_BCs[0][2] > 2.0
        np.testing.assert_allclose(p_BCs, [p_BCs[0]] * 3, atol=1e-5)
        click(reader, "follow")
        np.testing.assert_allclose(p_WC(reader), before, atol=1e-6)
        go_to(reader, 0.0)
        np.testing.assert_allclose(p_WC(reader), before, atol=1e-6)

    @pytest.mark.parametrize("time", [0.0, 6.0])
    def test_panels_do_not_cover_the_car_that_is_followed(self, reader, time):
        go_to(reader, time)
        click(reader, "follow")
        go_to(reader, time)
        covered = reader.evaluate(
            """(() => {
              const places = [];
              viewer.scene_tree.find(["vehicle", "base_link"]).object.traverse(
                ({geometry, matrixWorld}) => {
                  const {array = []} = geometry?.attributes.position ?? {};
                  for (let k = 0; k < array.length; k += 3) {
                    const {x, y} = new MeshCat.THREE.Vector3()
                      .fromArray(array, k).applyMatrix4(matrixWorld)
                      .project(viewer.camera);
                    places.push([(1 + x) / 2 * innerWidth,
                      (1 - y) / 2 * innerHeight]);
                  }
                });
              if (!places.length) return "no car";
              return places.filter((place) => {
                const there = document.elementFromPoint(...place);
                return !there || there.closest(".panel");
              });
            })()"""
        )
        click(reader, "follow")
        assert covered == []

    def test_slider_goes_forth_and_back(self, reader):
        clock = 'document.getElementById("clock").value'
        for time, text in (
            (10.0, "0:10"),
            (2.0, "0:02"),
            (6.4, "0:06"),
            (9.95, "0:10"),
        ):
            go_to(reader, time)
            assert reader.evaluate(clock) == f"{text} / 0:10"

    def test_plots_say_the_value_at_the_time(self, reader):
        for time in (0.0, 5.0, 10.0):
            go_to(reader, time)
            said = reader.evaluate(
                '[...document.querySelectorAll(".plot output")]'
                ".map((one) => one.value)"
            )
            # Half a metre a second more each frame.
            assert said[0] == f"{3.6 * 0.5 * time / PERIOD:.1f} km/h"
            assert said[1:] == ["0.1 m/s²", "0.2 m/s²", "5.7 deg/s"]
            line = 'document.getElementById("now").style.left'
            assert reader.evaluate(line) == f"{100 * time / 10.0:g}%"

    @pytest.mark.parametrize("away", [[30, 20, 5], [0.1, 90, 0], [-9, 2, 9]])
    def test_marker_is_above_the_car_on_the_screen(self, reader, away):
        go_to(reader, 5.0)
        x, y = reader.evaluate(
            f"""(() => {{
              const at = (name) => viewer.scene_tree.find(["vehicle", name])
                .object.getWorldPosition(new MeshCat.THREE.Vector3());
              const car = at("base_link");
              viewer.controls.target.copy(car);
              viewer.camera.position.set(...{away}).add(car);
              viewer.camera.lookAt(car);
              viewer.render();
              const tip = at("marker").project(viewer.camera);
              return tip.sub(car.project(viewer.camera)).toArray().slice(0, 2);
            }})()"""
        )
        assert abs(x) < 1e-6
        assert y > 0.02

    def test_controls_of_meshcat_are_hidden(self, reader):
        seen = reader.evaluate("viewer.gui.domElement.checkVisibility()")
        assert seen is False

    def test_panels_fold_and_leave_the_city(self, reader):
        def heights():
            return reader.evaluate(
                """["about", "plots", "course"].map(
                  (id) => document.getElementById(id).clientHeight)"""
            )

        assert all(heights())
        for name in ("fold", "unfold"):
            expanded = f"document.getElementById('{name}').ariaExpanded"
            assert reader.evaluate(expanded) == "true"
            click(reader, name)
            assert reader.evaluate(expanded) == "false"
        about, plots, course = heights()
        assert about == plots == 0
        assert course > 0
        top = "document.getElementById('bar').getBoundingClientRect().top"
        assert reader.evaluate(f"{top} / innerHeight") > 0.75
        for name in ("fold", "unfold"):
            click(reader, name)
        assert all(heights())

    def test_keys_play_and_move_in_time(self, reader):
        reader.evaluate("document.activeElement.blur()")
        reader.evaluate("viewer.animator.mixer.timeScale = 0.01")
        for is_playing in (True, False):
            reader.press(" ")
            assert reader.evaluate("viewer.animator.playing") is is_playing
        reader.evaluate("viewer.animator.mixer.timeScale = 1.0")
        go_to(reader, 4.0)
        reader.evaluate("document.getElementById('time').focus()")
        reader.press("ArrowRight")
        assert 4.0 < reader.evaluate("viewer.animator.time") < 10.0
        reader.evaluate("document.getElementById('route').focus()")
        for is_on in (False, True):
            reader.press(" ")
            assert is_visible(reader, "route") is is_on
        assert reader.evaluate("viewer.animator.playing") is False

    @pytest.mark.parametrize(
        ("name", "layers"),
        [
            ("route", [["route"]]),
            ("city", [["city"], ["before"]]),
        ],
    )
    def test_layers_can_be_hidden(self, reader, name, layers):
        for is_on in (True, False, True):
            assert [is_visible(reader, *layer) for layer in layers] == [
                is_on
            ] * len(layers)
            click(reader, name)
        click(reader, name)

    def test_drive_plays(self, reader):
        # Even a slow machine presses the button again before the end.
        reader.evaluate("viewer.animator.mixer.timeScale = 0.1")
        click(reader, "play")
        reader.wait_for("viewer.animator.time > 0.02")
        click(reader, "play")
        reader.evaluate("viewer.animator.mixer.timeScale = 1.0")
        label = reader.evaluate('document.getElementById("play").textContent')
        assert label == "Play"
        assert reader.evaluate("viewer.animator.playing") is False
