"""Recorded traffic: what a file says, and which road users a drive gets."""

from helpers.recorded_traffic import PERIOD, write_recorded, write_rounds
import numpy as np
import pytest

from cns_drake.traffic import EgoBox, play_recorded, read_recorded
from evaluation.base import InputError
from worlds.maps import shipped_maps

BOX = EgoBox(-1.0, 3.0, 1.0)


def far_away(t):
    return np.tile((900.0, 0.0), (len(t), 1)), np.zeros(len(t))


def play(recorded, vehicles=5, walkers=7, seed=1, duration=20.0, ego=far_away):
    return play_recorded(
        recorded, vehicles=vehicles, walkers=walkers, seed=seed,
        duration=duration, ego=ego, ego_box=BOX,
    )  # fmt: skip


@pytest.fixture(scope="module")
def rounds(tmp_path_factory):
    path = tmp_path_factory.mktemp("rounds") / "traffic.npz"
    write_rounds(path)
    return read_recorded(path)


def test_a_file_gives_the_places_that_were_written(tmp_path):
    """To half a unit, and with the gait of pedestrians."""
    rng = np.random.default_rng(2)
    vehicles = np.cumsum(rng.normal(0.0, 0.3, (50, 3, 5)), axis=0) + 200.0
    walkers = np.cumsum(rng.normal(0.0, 0.3, (50, 2, 4)), axis=0) - 300.0
    walkers[:, 1, :2] = walkers[0, 1, :2]
    path = tmp_path / "traffic.npz"
    write_recorded(path, vehicles, walkers, ["bus", "van", "suv"])
    found = read_recorded(path)
    assert [kind.name for kind in found.kinds] == ["bus", "van", "suv"]
    assert found.vehicles.duration == 49 * PERIOD
    for k in (0, 13, 48):
        there, _ = found.vehicles.at(k * PERIOD)
        np.testing.assert_allclose(there, vehicles[k], atol=2.6e-3)
        np.testing.assert_allclose(there[:, 3:], vehicles[k, :, 3:], atol=6e-4)
        there, _ = found.walkers.at(k * PERIOD)
        np.testing.assert_allclose(there[:, :4], walkers[k], atol=2.6e-3)
    phase = found.walkers.values[:, :, 4]
    speed = np.hypot(*np.diff(walkers[:, 0, :2], axis=0).T) / PERIOD
    stride = 0.7 * speed + 0.4
    np.testing.assert_allclose(
        np.diff(phase[:, 0]), 2 * np.pi * speed * PERIOD / stride, rtol=0.1
    )
    assert (np.diff(phase[:, 1]) == 0.0).all()


def test_between_places_of_a_file_are_smooth_cubics(tmp_path):
    """Gauss and Legendre's rule, which is exact for cubics, is the oracle."""
    rng = np.random.default_rng(5)
    path = tmp_path / "traffic.npz"
    values = np.cumsum(rng.uniform(0.0, 1.0, (20, 3, 5)), axis=0)
    write_recorded(path, values, values[..., :4])
    tracks = read_recorded(path).vehicles
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for k in range(19):
        for low, high in np.array([(0.0, 1.0), (0.3, 0.8)]) * PERIOD:
            t = PERIOD * k + low + (high - low) * (nodes + 1) / 2
            moved = np.tensordot(weights, tracks.at(t)[1], 1) * (high - low) / 2
            a, b = (tracks.at(PERIOD * k + end)[0] for end in (low, high))
            np.testing.assert_allclose(b - a, moved, atol=1e-9)
    for k in range(1, 19):
        value, rate = tracks.at(PERIOD * k)
        np.testing.assert_allclose(value, tracks.values[k], atol=1e-9)
        before = tracks.at(PERIOD * k - 1e-9)[1]
        np.testing.assert_allclose(rate, before, atol=1e-5)
    # Straight on before the first and after the last place.
    for t, end in ((-1.3, 0.0), (9.9, 9.5)):
        (value, rate), (expected, speed) = tracks.at(t), tracks.at(end)
        np.testing.assert_allclose(rate, speed)
        np.testing.assert_allclose(value, expected + (t - end) * speed)
    t = np.arange(-0.1, 10.0, 0.37)
    for many, each in zip(
        tracks.at(t), zip(*map(tracks.at, t), strict=True), strict=True
    ):
        np.testing.assert_array_equal(many, each)


@pytest.mark.parametrize(
    "name", ["downtown", "metropolis", "riverside", "suburbia"]
)
def test_shipped_traffic(name):
    """60 and 60 for ten minutes, no faster than traffic is."""
    recorded = read_recorded(shipped_maps()[name] / "traffic.npz")
    assert len(recorded.kinds) == 60
    assert recorded.walkers.values.shape == (1201, 60, 5)
    assert recorded.vehicles.duration == 600.0
    for tracks, fastest in ((recorded.vehicles, 20.0), (recorded.walkers, 3.0)):
        steps = np.diff(tracks.values[:, :, :2], axis=0)
        speed = np.hypot(*steps.T) / tracks.dt
        assert fastest / 2 < speed.max() < fastest
        assert (np.ptp(tracks.values[:, :, :2], axis=0) > 5.0).any(axis=1).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_seed_chooses_whom_and_from_when_on(rounds, seed):
    plan, again = play(rounds, seed=seed), play(rounds, seed=seed)
    other = play(rounds, seed=seed + 100)
    np.testing.assert_array_equal(plan.vehicles.values, again.vehicles.values)
    assert plan.kinds == again.kinds
    assert plan.vehicles.values.shape[1:] == (5, 5)
    assert plan.walkers.values.shape[1:] == (7, 5)
    assert plan.left_out == 0
    assert not np.array_equal(plan.walkers.values, other.walkers.values)
    # Each is a stretch of one of the recorded road users, the same for all.
    starts = set()
    for k, kind in enumerate(plan.kinds):
        gap = plan.vehicles.values[0, k] - rounds.vehicles.values
        start, which = np.argwhere((gap == 0.0).all(axis=2))[0]
        starts.add(int(start))
        assert rounds.kinds[which] == kind
        rows = slice(start, start + len(plan.vehicles.values))
        np.testing.assert_array_equal(
            plan.vehicles.values[:, k], rounds.vehicles.values[rows, which]
        )
    assert len(starts) == 1
    assert (len(plan.vehicles.values) - 1) * PERIOD > 20.0


def test_more_contain_fewer(rounds):
    few, many = play(rounds, vehicles=5), play(rounds, vehicles=9)
    first = {tuple(row) for row in few.vehicles.values[0]}
    assert first < {tuple(row) for row in many.vehicles.values[0]}


def test_nobody_who_would_meet_the_car_is_chosen(rounds):
    """The car stands on the circles of some."""
    xy = np.array([50.0 + 23.0, 10.0])

    def stands(t):
        return np.tile(xy, (len(t), 1)), np.zeros(len(t))

    some = play(rounds, 10, 30, duration=55.0, ego=stands)
    assert some.left_out == 0
    every = play(rounds, 20, 60, duration=55.0, ego=stands)
    kept = len(every.kinds) + every.walkers.values.shape[1]
    assert every.left_out == 80 - kept > 4
    radius = np.hypot(*(every.vehicles.values[0, :, :2] - (50.0, 10.0)).T)
    # The car covers 22 to 26 m, and each vehicle some more.
    assert not ((radius > 23.0) & (radius < 25.0)).any()
    assert ((radius > 27.4) & (radius < 28.5)).any()
    fewer = play(rounds, 20, 60, duration=5.0, ego=stands)
    assert fewer.left_out < every.left_out


def test_a_drive_that_is_longer_begins_with_the_recording(rounds):
    plan = play(rounds, duration=400.0)
    assert plan.vehicles.duration == rounds.vehicles.duration == 60.0
    first = {tuple(row) for row in plan.vehicles.values[0]}
    assert first < {tuple(row) for row in rounds.vehicles.values[0]}


@pytest.mark.parametrize(
    ("name", "array", "expected"),
    [
        ("period", None, "it has no array 'period'"),
        ("period", np.array(-1.0), "its arrays do not fit together"),
        ("kinds", np.array(["tank"] * 20), "kinds: 'tank' is none"),
        ("kinds", np.array(["bus"] * 21), "its arrays do not fit together"),
        ("walkers", np.zeros((4, 60, 3), "<i2"), "its arrays do not fit"),
        ("vehicles", np.zeros(3), ""),
        ("units", np.array(["a", "b"]), ""),
    ],
)
def test_files_that_are_none(tmp_path, name, array, expected):
    path = tmp_path / "traffic.npz"
    write_rounds(path)
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays[name] = array
    if array is None:
        del arrays[name]
    np.savez(path, **arrays)
    with pytest.raises(InputError) as error:
        read_recorded(path)
    start = f"{path}: no recorded traffic: {expected}"
    assert str(error.value).startswith(start)
    path.write_bytes(b"none")
    with pytest.raises(InputError, match="no recorded traffic"):
        read_recorded(path)
