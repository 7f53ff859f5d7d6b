"""Films of drives: images, order of shots, points, and files."""

import os

from helpers.internal.listening import listening
from helpers.small_map import box_visual, scenario_values, write_small_map
from helpers.tiny_drive import tiny_scenario
import numpy as np
from PIL import Image
import pytest

from cns_drake.scenarios import make_scenario
from cns_drake.simulation import make_film
from evaluation.base import InputError

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


@pytest.mark.parametrize(
    ("name", "size", "fault"),
    [
        ("a.mp4", (97, 54), r"even .*not 97x54$"),
        ("a.mp4", (96, 55), r"even .*not 96x55$"),
        ("a.gif", SIZE, r"a\.gif: the name"),
        ("a", SIZE, "a: the name"),
        ("a.webp.part", SIZE, r"a\.webp\.part: the name"),
    ],
)
def test_films_that_cannot_be(tmp_path, monkeypatch, name, size, fault):
    write_ffmpeg(tmp_path, "", monkeypatch)
    with pytest.raises(InputError, match=fault):
        make_film(tiny_scenario(tmp_path), tmp_path / name, size=size)


def test_mp4_needs_ffmpeg(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"a\.mp4: there is no ffmpeg"):
        make_film(tiny_scenario(tmp_path), tmp_path / "a.mp4", size=SIZE)
