"""Films of drives: images, order of shots, points, and files."""

import os
import re

from helpers.listening import listening
from helpers.small_map import box_visual, scenario_values, write_small_map
from helpers.tiny_drive import tiny_scenario
import numpy as np
from PIL import Image
from pydrake.math import RigidTransform
import pytest

from cns_drake import load_scenario, plan_drive
from cns_drake.base import InputError
from cns_drake.pictures import height_rgb
from cns_drake.scenarios import make_scenario
from cns_drake.sensors import CameraSection, optical_pose
from cns_drake.simulation import make_film, with_some_traffic
from cns_drake.simulation.film import (
    _VIEWS,
    _draw_points,
    _shot_times,
    check_film,
)

SIZE = (96, 54)
# A scan costs little with it.
LIDARS = {"lidar": {"preset": "vlp-16", "columns": 8}}


def frames_of(path):
    """Returns the images of a film (N, height, width, 3), and their times."""
    with Image.open(path) as film:
        images, times = [], []
        for k in range(film.n_frames):
            film.seek(k)
            images.append(np.asarray(film.convert("RGB"), float))
            times.append(film.info["duration"])
    return np.array(images), times


@pytest.mark.slow
@pytest.mark.night
def test_stages_come_in_turn_from_both_views(tmp_path):
    folder = write_small_map(tmp_path / "town")
    # In stage 04 a roof above the cameras takes the sun.
    roof = box_visual("roof/plate", (0, 0, 70, 0, 0, 0), (900, 900, 1))
    path = folder / "stage_04.sdf"
    path.write_text(path.read_text().replace("</link>", f"{roof}</link>"))
    scenario = make_scenario(
        scenario_values(folder) | {"lidars": LIDARS}, "test"
    )
    path = tmp_path / "a.webp"
    with listening() as heard:
        number = make_film(scenario, path, seconds=1.0, size=SIZE)
    images, times = frames_of(path)
    # Two images of each of two stages, behind the car and above.
    assert number == len(images) == 8
    assert images.shape[1:] == (54, 96, 3)
    assert set(times) == {100}
    done = heard.counts("filming")
    assert done == sorted(done)
    assert done[-1] == (8, 8)
    assert heard.activities[-1] == "writing the film"
    assert [file.name for file in tmp_path.iterdir()] == ["town", "a.webp"]
    street, above = images[:4], images[4:]
    # Clouds and sky are behind the car only.
    sky, roofs = (np.median(shot[:2, 12, :, 2]) for shot in (street, above))
    assert sky > roofs + 30
    for sunny_1, sunny_2, dark_1, dark_2 in images.reshape(2, 4, -1).mean(2):
        assert min(sunny_1, sunny_2) > 1.2 * max(dark_1, dark_2)


@pytest.mark.slow
@pytest.mark.night
def test_car_is_seen(tmp_path):
    path = tmp_path / "tiny.webp"
    scenario = tiny_scenario(tmp_path, lidars=LIDARS)
    size = (320, 180)
    assert make_film(scenario, path, seconds=1.0, size=size) == 10
    images, _ = frames_of(path)
    # The paint of worlds/vehicle.sdf is blue, the ground of the world grey.
    for name, view, shots in zip(
        _VIEWS, _VIEWS.values(), (images[:5], images[5:]), strict=True
    ):
        p_C = optical_pose(view).inverse() @ np.array([0.6, 0.0, 1.0])
        scale = size[1] / 2 / np.tan(np.radians(view.fov_y_deg) / 2)
        x, y = np.array(size) / 2 + scale * p_C[:2] / p_C[2]
        near = shots[:, int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2]
        assert (near[..., 2] - near[..., 0]).mean() > 15.0, name
        aside = shots[:, int(y), [int(x) - 40, int(x) + 40]]
        assert (aside[..., 2] - aside[..., 0]).mean() < 15.0, name


def test_points_are_drawn_where_a_camera_sees_them():
    camera = CameraSection(width=41, height=31, fov_y_deg=90.0)
    X_WC = RigidTransform([1.0, 2.0, 3.0]) @ optical_pose(
        CameraSection(xyz=(0.0, 0.0, 0.0))
    )
    # Ahead; a third to the left; a third up; behind; outside; a pixel's depth.
    p_WQ = np.array(
        [[11, 2, 3], [11, 5, 3], [11, 2, 6], [-9, 2, 3], [11, 40, 3]], float
    )

    def drawn(depth):
        pixels = np.zeros((31, 41, 3), np.uint8)
        _draw_points(pixels, np.full((31, 41), depth), X_WC, camera, p_WQ)
        return pixels

    pixels = drawn(np.inf)
    places = [(15, 20), (15, 15), (10, 20)]
    assert sorted(zip(*pixels.any(axis=2).nonzero(), strict=True)) == sorted(
        places
    )
    for place, point in zip(places, p_WQ, strict=False):
        expected = np.round(255 * height_rgb(point[2:])[0])
        np.testing.assert_array_equal(pixels[place], expected)
    # A surface 0.4 m before the points does not hide them yet.
    assert drawn(9.61).any()
    assert not drawn(9.59).any()


class TestTimes:
    @pytest.fixture
    def trajectory(self, tmp_path):
        """50 m, a bend to the left, and 55 m."""
        return plan_drive(tiny_scenario(tmp_path))

    def test_shot_is_straight(self, trajectory):
        times = _shot_times(trajectory, 30, None)
        np.testing.assert_allclose(np.diff(times), 0.1)
        yaw = [trajectory.pose(t).rotation().matrix()[1, 0] for t in times]
        assert np.ptp(yaw) < 0.01
        travelled = np.ptp(trajectory.travelled(times))
        assert travelled > 0.99 * 2.9 * 6.0  # At full speed.

    def test_shot_longer_than_the_drive_ends_with_it(self, trajectory):
        times = _shot_times(trajectory, 100_000, None)
        assert times[0] == 0.0
        assert times[-1] == trajectory.duration

    def test_start(self, trajectory):
        end = trajectory.duration
        assert _shot_times(trajectory, 3, end)[0] == end
        np.testing.assert_allclose(
            _shot_times(trajectory, 3, 2.0), [2, 2.1, 2.2]
        )
        with pytest.raises(
            InputError, match=r"--start-time: .*the drive takes"
        ):
            _shot_times(trajectory, 3, end + 1e-6)


def write_ffmpeg(folder, script, monkeypatch):
    path = folder / "ffmpeg"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    path_of_programs = f"{folder}{os.pathsep}{os.environ['PATH']}"
    monkeypatch.setenv("PATH", path_of_programs)


@pytest.mark.slow
@pytest.mark.night
def test_mp4_has_the_images_as_ffmpeg_gets_them(tmp_path, monkeypatch):
    programs = tmp_path / "programs"
    programs.mkdir()
    scenario = tiny_scenario(tmp_path, lidars=LIDARS)
    path = tmp_path / "tiny.mp4"
    # Before the last word, the file, comes the pattern of the images' names.
    script = """while [ "$1" != -i ]; do shift; done
ls "${2%/*}" > list; for last; do :; done; mv list "$last"; echo "$2" >> "$last"
"""
    write_ffmpeg(programs, script, monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert make_film(scenario, path, seconds=1.0, size=(32, 32)) == 10
    *names, pattern = path.read_text().split()
    assert names == [pattern.rpartition("/")[2] % k for k in range(10)]
    write_ffmpeg(programs, "echo no codec >&2; exit 1", monkeypatch)
    other = tmp_path / "other.mp4"
    with pytest.raises(InputError, match=r"other.mp4: ffmpeg: no codec$"):
        make_film(scenario, other, seconds=1.0, size=(32, 32))
    assert not list(tmp_path.glob("other*"))


@pytest.mark.slow
@pytest.mark.parametrize("size", [(97, 54), (96, 55)])
def test_mp4_has_even_sides(tmp_path, monkeypatch, size):
    write_ffmpeg(tmp_path, "", monkeypatch)
    check_film(tmp_path / "a.webp", size)
    check_film(tmp_path / "a.mp4", (96, 54))
    with pytest.raises(InputError, match=r"even .*not \d\dx\d\d$"):
        check_film(tmp_path / "a.mp4", size)


def test_mp4_needs_ffmpeg(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"a\.mp4: there is no ffmpeg"):
        check_film(tmp_path / "a.mp4", SIZE)


@pytest.mark.parametrize("name", ["a.gif", "a", "a.webp.part"])
def test_other_formats_are_refused(tmp_path, name):
    with pytest.raises(InputError, match=re.escape(f"{name}: the name")):
        check_film(tmp_path / name, SIZE)


def test_traffic_comes_where_there_is_room(tmp_path):
    shipped = load_scenario("metropolis_01")
    assert with_some_traffic(shipped).traffic.vehicles == 60
    assert with_some_traffic(shipped).traffic.walkers == 60
    busy = shipped.with_traffic(7)
    assert with_some_traffic(busy) == busy
    bare = tiny_scenario(tmp_path)
    assert with_some_traffic(bare) == bare
