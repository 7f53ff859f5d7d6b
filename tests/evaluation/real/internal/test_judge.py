"""The judge of real and simulated scans, on scans of boxes."""

from pathlib import Path
import sys

from helpers.drive_files import yaw_pose
import numpy as np
import pytest

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).parents[3] / "benchmarks"
PLACES = 6


@pytest.fixture(scope="module")
def judge():
    from evaluation.real import judge

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "_TREES", 10)
        patch.setattr(judge, "_PATCHES", 8)
        patch.setattr(judge, "_NEIGHBOURHOODS", 40)
        yield judge


@pytest.fixture(scope="module")
def program():
    sys.path.insert(0, str(FOLDER))
    import real_or_simulated

    sys.path.remove(str(FOLDER))
    return real_or_simulated


def make_place(folder, seed, *, rough=0.005, bias=0.0, texture=3.0):
    """Writes a scan of a ground with two walls, ring by ring.

    Args:
        folder: gets the scan.
        seed: of the walls and of all noise.
        rough: noise of ranges [m].
        bias: of the range of each ring [m].
        texture: noise of intensities.
    """
    rng = np.random.default_rng(seed)
    elevation = np.deg2rad(np.linspace(5.0, -25.0, 32))[:, None]
    azimuth = np.linspace(1e-3, 6.283, 400)
    ground = np.where(elevation < 0.0, 1.7 / -np.sin(elevation), np.inf)
    ranges = np.broadcast_to(ground, (32, 400))
    for side in (1.0, -1.0):
        across = rng.uniform(6.0, 9.0) / (side * np.sin(azimuth))
        wall = np.where(across > 0.0, across / np.cos(elevation), np.inf)
        ranges = np.minimum(ranges, wall)
    ranges = ranges + rng.normal(0.0, rough, ranges.shape)
    ranges = ranges + bias * rng.normal(size=(32, 1))
    d = np.stack(
        np.broadcast_arrays(
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ),
        axis=-1,
    )
    bright = np.clip(rng.normal(0.3, texture / 100.0, ranges.shape), 0, 0.99)
    near = ranges < 60.0
    scan = np.column_stack([ranges[near, None] * d[near], bright[near]])
    folder.mkdir(parents=True)
    scan.astype(np.float32).tofile(folder / "000000.bin")


def features(judge, program, folder, seed, **options):
    for place in range(PLACES):
        make_place(folder / str(place), 100 * seed + place, **options)
    return judge.Features.of_places(program.read_places(folder))


@pytest.fixture(scope="module")
def plain(judge, program, tmp_path_factory):
    return features(judge, program, tmp_path_factory.mktemp("plain") / "set", 1)


@pytest.mark.night
def test_equal_sets_are_not_told_apart(judge, program, plain, tmp_path):
    result = judge.aucs_by_group(
        plain, features(judge, program, tmp_path / "set", 2)
    )
    assert abs(result["auc"]["all"] - 0.5) < 0.15
    assert abs(result["control"]["all"] - 0.5) < 0.2


@pytest.mark.parametrize(
    ("options", "group", "feature"),
    [
        ({"texture": 0.0}, "intensity", "spread among 6"),
        pytest.param(
            {"bias": 0.03},
            "roughness",
            "between rings",
            marks=pytest.mark.night,
        ),
    ],
)
def test_it_finds_the_difference(
    judge, program, plain, tmp_path, options, group, feature
):
    other = features(judge, program, tmp_path / "set", 3, **options)
    result = judge.aucs_by_group(plain, other)
    assert result["auc"][group] > 0.95
    names = judge.common_names([plain, other])
    features_of_both = program.strongest(plain, other, names)
    first = features_of_both[0]
    assert first["feature"].startswith(group)
    assert any(feature in row["feature"] for row in features_of_both[:6])
    assert first["auc"] > 0.95


def test_a_result_is_the_mean_of_draws(judge, program, tmp_path, monkeypatch):
    # Means need neither a classifier nor many patches.
    for name in ("_PATCHES", "_NEIGHBOURHOODS"):
        monkeypatch.setattr(judge, name, 5)
    monkeypatch.setattr(
        judge,
        "tell_apart",
        lambda real, other, names: (
            np.nanmean(real.of(names)) - np.nanmean(other.of(names))
        ),
    )
    sets = []
    for seed in (1, 2):
        for place in range(2):
            folder = tmp_path / str(seed) / str(place)
            make_place(folder, 100 * seed + place)
        sets.append(program.read_places(tmp_path / str(seed)))
    single = [
        judge.aucs_by_group(
            *(judge.Features.of_places(places, seed) for places in sets)
        )
        for seed in (0, 1)
    ]
    mean = judge.judge_draws(*sets, 2)
    for key in ("auc", "control"):
        assert mean[key]["all"] == pytest.approx(
            (single[0][key]["all"] + single[1][key]["all"]) / 2
        )
    assert single[0]["auc"]["all"] != single[1]["auc"]["all"]


def test_rings_follow_from_the_order_of_a_file(program, tmp_path):
    make_place(tmp_path / "one", 0)
    [[scan]] = program.read_places(tmp_path)
    elevation = np.arcsin(scan[:, 2] / np.linalg.norm(scan[:, :3], axis=1))
    _, first = np.unique(scan[:, 4], return_index=True)
    assert np.ptp(np.diff(elevation[first])) < 1e-6
    assert len(first) >= 25


def test_without_a_folder_it_says_so(program, tmp_path, monkeypatch):
    words = ["judge", str(tmp_path / "none"), str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit, match=r"none: no folder of scans"):
        program.main()


def test_a_long_drive_has_a_place_every_30_m(program, tmp_path):
    # A scan every 8 m: the fourth is 24 m from the first, the fifth 32 m.
    make_place(tmp_path / "velodyne", 0)
    file = tmp_path / "velodyne" / "000000.bin"
    for k in range(1, 9):
        (file.parent / f"{k:06d}.bin").write_bytes(file.read_bytes())
    rows = [f"1 0 0 {8 * k} 0 1 0 0 0 0 1 0" for k in range(9)]
    (tmp_path / "poses.txt").write_text("\n".join(rows))
    (tmp_path / "times.txt").write_text("\n".join(map(str, range(9))))
    assert [len(one) for one in program.read_places(tmp_path)] == [4, 4, 1]


class Drive:
    """A drive with a scan of one point at each position x y [m]."""

    def __init__(self, *positions, world="map", city="one"):
        self.X_WS = np.array([yaw_pose(*xy, 0.0, 0.0) for xy in positions])
        self.world_frame = world
        self.scenario = {"map": city}

    def __len__(self):
        return len(self.X_WS)

    def scan(self, index):
        return np.array([[*self.X_WS[index, :3, 3], 1.0]])


def test_a_place_is_the_same_when_a_drive_returns(judge):
    # Out and back, with the last scan just less than 30 m from the first one.
    out = [(0.0, 0.0), (25.0, 0.0), (30.0, 0.0), (59.9, 0.0), (60.0, 0.0)]
    loop = Drive(*out, *out[::-1], (0.0, 29.9))
    found = judge.places_of([loop, Drive((0.0, -29.9), (0.0, -30.0))])
    xs = [[tuple(scan[0, :2]) for scan in place] for place in found]
    assert xs == [
        [*out[:2], *out[1::-1], (0.0, 29.9), (0.0, -29.9)],
        [*out[2:4], *out[3:1:-1]],
        [out[4], out[4]],
        [(0.0, -30.0)],
    ]


def test_other_worlds_have_other_places(judge):
    here = (1.0, 2.0)
    others = Drive(here, world="kitti/00"), Drive(here, city="two")
    found = judge.places_of([Drive(here), *others, Drive(here)])
    assert [len(place) for place in found] == [2, 1, 1]


def test_on_a_straight_road_places_are_runs(judge):
    x = np.cumsum(np.random.default_rng(1).uniform(0.0, 40.0, 40))
    runs = [[x[0]]]
    for one in x[1:]:
        if one - runs[-1][0] < 30.0:
            runs[-1].append(one)
        else:
            runs.append([one])
    found = judge.places_of([Drive(*((one, 0.0) for one in x))])
    assert [[scan[0, 0] for scan in place] for place in found] == runs


def test_scans_without_points_are_left_out(judge):
    drive = Drive((0.0, 0.0), (5.0, 0.0), (90.0, 0.0))
    drive.name = "one"
    drive.scan = lambda k: np.zeros((0, 4)) if k else np.ones((1, 4))
    told = []
    found = judge.places_of([drive], note=told.append)
    assert [len(place) for place in found] == [1]
    assert told == ["one: 2 scans without points left out"]
    assert judge.image_table(np.zeros((0, 4))).shape == (0, 5)
