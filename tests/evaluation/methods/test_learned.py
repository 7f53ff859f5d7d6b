"""The learned descriptor: images, network, scores, files of weights."""

from helpers.learned_weights import weight_values
import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import LAYERS, SECTORS, TURNS, make_method, polar_image


def write(path, **changes):
    values = weight_values(**changes)
    np.savez(path, **{k: v for k, v in values.items() if v is not None})
    return path


@pytest.fixture
def method(tmp_path):
    return make_method("learned", {"weights": write(tmp_path / "w.npz")})


def scene(seed, number=4000):
    rng = np.random.default_rng(seed)
    azimuth = rng.uniform(-np.pi, np.pi, number)
    distance = rng.uniform(2.0, 60.0, number)
    height = rng.uniform(-1.5, 9.0, number)
    return np.stack(
        [distance * np.cos(azimuth), distance * np.sin(azimuth), height], axis=1
    )


def turned(points, yaw):
    c, s = np.cos(yaw), np.sin(yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def test_channels_of_single_points():
    azimuth = (10 + 0.5) * 2.0 * np.pi / SECTORS
    where = 5.5 * np.array([np.cos(azimuth), np.sin(azimuth)])
    points = np.array([[*where, h - 2.0] for h in (0.25, 1.5, 10.0)])
    far = np.array([[64.1, 0.0, 0.0]])
    image = polar_image(np.concatenate([points, far]), 2.0)
    assert np.argwhere(image.any(axis=2)).tolist() == [[5, 10]]
    cell = image[5, 10]
    # 1.5 m is in the second band, 10 m in the last; 0.25 m is ground.
    assert cell[:5].tolist() == [0, 255, 0, 0, 255]
    assert cell[5:].tolist() == [
        int(1 + 254 * 10.0 / 16.0),
        255,
        int(1 + 254 * 3.25 / 6.0),
    ]


def test_a_turn_shifts_the_image():
    points = scene(1)
    shift = 23
    image = polar_image(turned(points, shift * 2 * np.pi / SECTORS), 1.6)
    expected = np.roll(polar_image(points, 1.6), shift, axis=1)
    # Rounding moves a point on a border now and then.
    assert (image != expected).any(axis=2).mean() < 1e-3


def test_scores_do_not_depend_on_the_heading(method):
    scenes = [scene(seed) for seed in range(5)]
    database = method.build_database([method.describe(s) for s in scenes])
    for place, points in enumerate(scenes):
        # A whole number of steps of the map of features.
        yaw = 2.0 * np.pi * (7 * place + 3) / TURNS
        query = method.describe(turned(points, -yaw))
        scores = method.score(query, database)
        assert scores.argmax() == place
        assert scores[place] == pytest.approx(1.0, abs=0.02)
        X_PQ = method.relative_pose(query, database, place)
        assert X_PQ[:3, :3] @ [1.0, 0.0, 0.0] == pytest.approx(
            [np.cos(yaw), np.sin(yaw), 0.0], abs=1e-9
        )


def test_scans_without_points(method):
    empty = method.describe(np.zeros((0, 3)))
    full = method.describe(scene(2))
    database = method.build_database([full, empty])
    assert np.isnan(method.score(empty, database)).all()
    assert np.isnan(method.score(full, database)).tolist() == [False, True]
    assert method.relative_pose(full, database, 1) is None
    assert method.relative_pose(empty, database, 0) is None


def test_a_narrow_sensor_is_noted_once(method, capsys):
    points = scene(3)
    ahead = points[np.abs(np.arctan2(points[:, 1], points[:, 0])) < 0.6]
    for _ in range(2):
        method.describe(ahead)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert "points in 20 % of the image's sectors" in lines[0]
    assert "50 % or more" in lines[0]


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"version": np.int64(2)}, "version: 2 instead of 1"),
        ({"version": None}, "version: None"),
        ({"kernel_1": np.zeros((9, 4))}, "kernel_1: size (9, 4) instead"),
        ({"bias_2": None}, "bias_2 is missing"),
        ({"bias_2": np.full(LAYERS[2][1], np.nan)}, "not all are finite"),
    ],
)
def test_faulty_weights(tmp_path, changes, fault):
    path = write(tmp_path / "w.npz", **changes)
    with pytest.raises(InputError) as error:
        make_method("learned", {"weights": path})
    assert str(error.value).startswith(f"{path}: ")
    assert fault in str(error.value)
    assert "\n" not in str(error.value)


def test_other_weights_are_another_method(tmp_path):
    path = write(tmp_path / "w.npz")
    first = make_method("learned", {"weights": path}).config.model_dump()
    write(path, bias_0=np.ones(LAYERS[0][1]))
    second = make_method("learned", {"weights": path}).config.model_dump()
    assert first["digest"] != second["digest"]


def test_other_files_are_no_weights(tmp_path):
    path = tmp_path / "w.npz"
    with pytest.raises(InputError, match="No such file"):
        make_method("learned", {"weights": path})
    path.write_bytes(b"no archive")
    with pytest.raises(InputError, match="no file of weights"):
        make_method("learned", {"weights": path})


def test_weights_that_are_no_numbers_in_single_precision(tmp_path):
    largest = float(np.finfo(np.float32).max)
    shape = (9 * LAYERS[0][0], LAYERS[0][1])
    path = write(tmp_path / "w.npz", kernel_0=np.full(shape, largest))
    make_method("learned", {"weights": path})
    for value in (1.01 * largest, 1e300, np.nan, np.inf):
        path = write(tmp_path / "w.npz", kernel_0=np.full(shape, value))
        with pytest.raises(InputError, match=r"w\.npz: kernel_0: not all are"):
            make_method("learned", {"weights": path})
