"""Sessions, baselines and scores on small clouds with counted answers."""

from helpers.labelled_maps import clouds, write_map
import numpy as np
import pytest

from evaluation.map_update import Label, read_pair
from evaluation.map_update.baselines import by_distance, by_free_space


def test_by_distance_is_brute_force(tmp_path):
    pair, _ = clouds(tmp_path)
    apart = np.linalg.norm(
        pair.A.points[:, None] - pair.B.points[None], axis=2
    ).min(axis=1)
    expected = np.where(apart <= 0.5, Label.KEPT, Label.GONE)
    np.testing.assert_array_equal(by_distance(*pair), expected)


def room(size, beams=(200, 60), window=None):
    """A scan of a box-shaped room around the LiDAR; a window returns nothing.

    Args:
        size: distance of the walls [m].
        beams: directions around and upwards.
        window: whether a direction (N, 3) passes through it.
    """
    azimuth, up = np.meshgrid(
        np.linspace(-np.pi, np.pi, beams[0], endpoint=False),
        np.linspace(-0.5, 0.5, beams[1]),
    )
    d = np.stack(
        [
            np.cos(up) * np.cos(azimuth),
            np.cos(up) * np.sin(azimuth),
            np.sin(up),
        ],
        axis=-1,
    ).reshape(-1, 3)
    points = d * (size / np.abs(d).max(axis=1, keepdims=True))
    return points if window is None else points[~window(points)]


@pytest.mark.slow
def test_free_space_sees_past_what_is_gone(tmp_path):
    """A's map: a wall at 10 m, a box at 5 m, things at 30 m and overhead.

    B sees the wall, but not the box; what is outside, the wall hides. Points of
    B beside some of the box, but not at it, do not keep it. A bird does not
    widen B's field of view to what is overhead.
    """
    rng = np.random.default_rng(1)
    box = np.array([5.0, 0.0, 0.0]) + rng.uniform(-0.5, 0.5, (200, 3))
    outside = np.array([30.0, 0.0, 0.0]) + rng.uniform(-0.5, 0.5, (200, 3))
    overhead = np.array([0.0, 0.0, 9.0]) + rng.uniform(-0.5, 0.5, (200, 3))
    wall = room(10.0)[::7]
    write_map(tmp_path / "A", np.concatenate([wall, box, outside, overhead]))
    beside = box[:100] + np.array([0.15, 0.0, 0.0])
    away = np.linalg.norm(beside[:, None] - box, axis=2).min(axis=1)
    beside = beside[away > 0.125]
    assert len(beside) > 10
    write_map(tmp_path / "B", np.concatenate([room(10.0), beside]))
    folder = tmp_path / "B" / "Scans"
    folder.mkdir()
    scan = np.concatenate([room(10.0), [[0.01, 0.0, 3.0]]])
    rows = "\n".join(" ".join(f"{v:.6f}" for v in p) for p in scan)
    count = len(scan)
    (folder / "000000.pcd").write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\n"
        f"DATA ascii\n{rows}\n"
    )
    (tmp_path / "B" / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    pair = read_pair(tmp_path)
    labels = by_free_space(*pair)
    n = len(wall)
    assert (labels[:n] == Label.KEPT).all()
    assert (labels[n : n + 200] == Label.GONE).all()
    # Beyond its reach or its field of view, or hidden.
    assert (labels[n + 200 :] == Label.UNOBSERVED).all()


@pytest.mark.slow
def test_m3c2_measures_a_moved_plane(tmp_path, monkeypatch, capsys):
    # It has no wheel for ARM with Linux.
    pytest.importorskip("py4dgeo")
    monkeypatch.chdir(tmp_path)
    from evaluation.map_update.baselines import by_m3c2

    rng = np.random.default_rng(2)
    flat = np.c_[rng.uniform(0, 20, (20_000, 2)), rng.normal(0, 0.005, 20_000)]
    moved = flat + np.where(flat[:, :1] > 10.0, [0, 0, 0.5], [0, 0, 0.0])
    write_map(tmp_path / "A", flat)
    write_map(tmp_path / "B", moved)
    labels = by_m3c2(*read_pair(tmp_path))
    assert capsys.readouterr().out == ""
    assert not list(tmp_path.glob("*.log"))
    x = flat[:, 0]
    assert np.mean(labels[x > 12] == Label.GONE) > 0.95
    assert np.mean(labels[x < 8] == Label.KEPT) > 0.95
