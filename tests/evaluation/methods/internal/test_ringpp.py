import math

import numpy as np
import pytest

from evaluation.base import InputError
from evaluation.methods import make_method
from evaluation.methods.ringpp import RingPlusPlus, _normalise, radon

CELL = 140.0 / 120.0
# Least possible distance of a pair, see `test_no_pair_is_nearer`.
NEAREST = 1.0 - 1.0 / (0.15 * math.sqrt(120.0))


def ring(**parameters) -> RingPlusPlus:
    return make_method("ring++", parameters)


def make_scene(seed, number=40, half_width=45.0):
    """Returns walls around the sensor, (N, 3); it is 1.6 m high."""
    rng = np.random.default_rng([seed, 21])
    parts = []
    for _ in range(number):
        size = rng.uniform(1.0, 12.0)
        direction = rng.uniform(0.0, math.pi)
        along = rng.uniform(-size, size, 80)
        foot = rng.uniform(-half_width, half_width, 2)
        z = rng.uniform(-1.6, rng.uniform(1.0, 9.0), 80)
        x = foot[0] + along * math.cos(direction)
        y = foot[1] + along * math.sin(direction)
        parts.append(np.stack([x, y, z], axis=1))
    return np.concatenate(parts)


def pose(x, y, yaw_deg):
    a = math.radians(yaw_deg)
    X = np.eye(4)
    X[:2, :2] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
    X[:2, 3] = x, y
    return X


def seen_from(X_PQ, points_P):
    """Returns points of one frame, expressed in another one."""
    X_QP = np.linalg.inv(X_PQ)
    return points_P @ X_QP[:3, :3].T + X_QP[:3, 3]


def score(method, query, place):
    database = method.build_database([method.describe_place(place)])
    return method.score(method.describe(query), database)[0]


def post(x, y, *heights):
    return np.array([[x, y, z] for z in heights])


def bev(scan, **parameters):
    image = ring(**parameters).describe(np.asarray(scan)).bev(120)
    return np.moveaxis(image, 0, 2)


class TestBev:
    @pytest.mark.parametrize(
        ("x", "y", "row", "column"),
        [
            (0.01, 0.01, 60, 60),
            (-0.01, CELL - 0.01, 59, 60),
            (-69.99, 69.99, 0, 119),
            (-69.99, CELL - 69.99, 0, 1),
            (20.0 * CELL + 0.01, -10.0 * CELL - 0.01, 80, 49),
        ],
    )
    def test_cells(self, x, y, row, column):
        image = bev(post(x, y, 0.0, 2.0))
        # A vertical line: only range and variance of z are not zero.
        expected = np.zeros((120, 120, 6))
        expected[row, column, 4:] = 2.0 / 10.0, (1.0 / 10.0) ** 2
        np.testing.assert_allclose(image, expected, atol=1e-5)

    def test_a_cell_holds_the_greatest_values(self):
        # Three points, of which each has the nearest one as neighbour: with
        # heights 0, 1 and 3, ranges are 1, 1 and 2.
        image = bev(post(10.0, 10.0, 0.0, 1.0, 3.0), neighbours=2)
        assert image[68, 68, 4] == pytest.approx(0.2)
        assert image[68, 68, 5] == pytest.approx(0.1**2)

    def test_shape_is_described_in_scaled_coordinates(self):
        # The scene is as wide as high in units of 70 m and 10 m.
        a, b = 0.7, 0.1
        scan = np.array(
            [
                [a, 0, 0],
                [-a, 0, 0],
                [0, a, 0],
                [0, -a, 0],
                [0, 0, b],
                [0, 0, -b],
            ]
        )
        image = bev(scan + np.array([20.3, 20.3, 1.0]))
        filled = image[image.any(axis=2)]
        np.testing.assert_allclose(
            filled[:, :4],
            np.tile([1 / 3, 1 / 3, math.log(3.0), 1.0], (len(filled), 1)),
            rtol=1e-5,
        )

    @pytest.mark.parametrize("sensor_height", [1.6, 1.73, 2.5])
    def test_limits(self, sensor_height):
        low, high = 0.73 - sensor_height, 11.73 - sensor_height
        inside = [[30.0, 0.0, low + 0.001], [30.0, 0.0, high - 0.001]]
        outside = [
            [30.0, 0.0, low - 0.001],
            [30.0, 0.0, high + 0.001],
            [70.001, 0.0, 1.0],
            [0.0, -70.001, 1.0],
        ]
        one = bev(inside, sensor_height=sensor_height)
        both = bev(inside + outside, sensor_height=sensor_height)
        assert one[85, 60, 4] == pytest.approx(1.1 - 0.0002, abs=1e-6)
        np.testing.assert_array_equal(one, both)

    def test_follows_the_sensor_height(self):
        scan = make_scene(1)
        lifted = ring().describe(scan)
        # A sensor 0.5 m higher sees all 0.5 m lower.
        lower = ring(sensor_height=2.1).describe(scan - [0.0, 0.0, 0.5])
        np.testing.assert_allclose(
            lower.bev(120), lifted.bev(120), rtol=1e-4, atol=1e-5
        )

    def test_duplicates_and_missing_returns_do_not_count(self):
        scan = make_scene(2)
        more = np.vstack([scan[::-1], np.zeros((40, 3)), scan[::2]])
        np.testing.assert_array_equal(bev(scan), bev(more))


class TestScore:
    @pytest.mark.parametrize("n", [12, 13])
    def test_against_the_definition(self, n):
        """The definition is computed in full: each pair, each shift."""
        method = ring(cells=n)
        scans = [make_scene(seed) for seed in (3, 4)]
        normalised = []
        for scan in scans:
            image = np.moveaxis(method.describe(scan).bev(n), 0, 2)
            sinogram = radon(image, np.linspace(0.0, 2.0 * math.pi, n))
            magnitudes = np.abs(np.fft.fft(sinogram, axis=1, norm="ortho"))
            mean = magnitudes.mean(axis=(0, 1))
            variance = magnitudes.var(axis=(0, 1))
            normalised.append((magnitudes - mean) / np.sqrt(variance + 1e-5))
        sums = []
        for shift in range(n):
            products = normalised[0] * np.roll(normalised[1], shift, axis=0)
            # The transforms of the program are unitary.
            correlation = products.sum(axis=0) / math.sqrt(n)
            sums.append(np.abs(correlation).sum())
        expected = np.array(sums) / (0.15 * 6 * n * n)
        query, place = (method.describe(scan) for scan in scans)
        database = method.build_database([place])
        assert method.score(query, database) == pytest.approx(max(expected))

    @pytest.mark.parametrize("cells", [31, 32])
    def test_half_spectra_normalise_as_whole_ones(self, cells):
        rng = np.random.default_rng([cells])
        signals = rng.uniform(size=(3, 7, cells))
        whole = np.abs(np.fft.fft(signals, axis=2)).transpose(0, 2, 1)
        mean = whole.mean(axis=(1, 2), keepdims=True)
        deviation = np.sqrt(whole.var(axis=(1, 2), keepdims=True) + 1e-5)
        expected = ((whole - mean) / deviation)[:, : cells // 2 + 1]
        half = np.abs(np.fft.rfft(signals, axis=2)).transpose(0, 2, 1)
        np.testing.assert_allclose(_normalise(half, cells), expected)

    def test_no_pair_is_nearer(self):
        # By the Cauchy-Schwarz inequality; a constant close to it appears
        # for equal scans with channels of great variance.
        method = ring()
        descriptors = [method.describe(make_scene(seed)) for seed in range(5)]
        database = method.build_database(descriptors)
        distances = 1.0 - np.array(
            [method.score(one, database) for one in descriptors]
        )
        assert pytest.approx(0.39142, abs=5e-6) == NEAREST
        assert (distances > NEAREST - 1e-5).all()
        own = np.diagonal(distances)
        assert (own < 0.45).all()
        others = distances[~np.eye(5, dtype=bool)].reshape(5, 4)
        assert (others > own[:, None] + 0.005).all()
        np.testing.assert_allclose(distances, distances.T, atol=1e-5)

    def test_a_moved_scan_is_nearer_than_another_place(self):
        method = ring()
        scan = make_scene(6)
        own = score(method, scan, scan)
        moved = score(method, seen_from(pose(4.0, -3.0, 0.0), scan), scan)
        turned = score(method, seen_from(pose(0.0, 0.0, 75.0), scan), scan)
        other = score(method, make_scene(7), scan)
        assert own >= max(moved, turned)
        assert min(moved, turned) > other + 0.2 * (own - other)

    def test_nothing_to_see(self):
        method = ring()
        scene = make_scene(8)
        ground = scene * [1.0, 1.0, 0.0] - [0.0, 0.0, 1.6]
        nothing = [np.empty((0, 3)), np.array([[9.0, 9.0, 1.0]]), ground]
        places = [method.describe_place(scan) for scan in [*nothing, scene]]
        database = method.build_database(places)
        for place in places[:3]:
            assert np.isnan(method.score(place, database)).all()
            assert method.relative_pose(place, database, 3) is None
            assert not place.bev(120).any()
        scores = method.score(places[3], database)
        np.testing.assert_array_equal(np.isnan(scores), [True] * 3 + [False])
        assert method.relative_pose(places[3], database, 0) is None

    def test_places_are_scored_alike_in_any_number(self):
        method = ring()
        descriptors = [method.describe(make_scene(s)) for s in range(4)]
        many = method.build_database(descriptors * 5)
        scores = method.score(descriptors[0], many)
        np.testing.assert_array_equal(scores, np.tile(scores[:4], 5))

    def test_same_scan_same_bytes(self):
        scan = make_scene(9)
        one, two = (ring().describe(scan.copy()) for _ in range(2))
        assert one.spectrum.tobytes() == two.spectrum.tobytes()
        assert one.features.tobytes() == two.features.tobytes()


@pytest.fixture(scope="module")
def rings():
    """Descriptors of places, and of each from elsewhere."""
    method = ring(cells=60)
    scenes = [make_scene(seed) for seed in range(40, 60)]
    places = [method.describe_place(one) for one in scenes]
    motions = [pose(0.2 * k, 2.0 - 0.2 * k, 17.0 * k) for k in range(20)]
    queries = [
        method.describe(seen_from(motion, scene))
        for motion, scene in zip(motions, scenes, strict=True)
    ]
    return places, queries


class TestCandidates:
    def test_all_places_are_the_default(self, rings):
        places, queries = rings
        whole, part = ring(cells=60), ring(cells=60, candidates=20)
        database = whole.build_database(places)
        for query in queries[:5]:
            expected = whole.score(query, database)
            found = part.score(query, database)
            np.testing.assert_array_equal(found, expected)

    def test_the_best_places_have_their_scores(self, rings):
        places, queries = rings
        whole, part = ring(cells=60), ring(cells=60, candidates=5)
        for query in queries:
            database = part.build_database(places)
            found = part.score(query, database)
            chosen = ~np.isnan(found)
            assert chosen.sum() == 5
            expected = whole.score(query, database)
            np.testing.assert_array_equal(found[chosen], expected[chosen])
            assert np.nanargmax(found) == expected.argmax()
            # If places are excluded, each is compared.
            every = part.score(query, database, exhaustive=True)
            np.testing.assert_array_equal(every, expected)

    def test_all_frequencies_choose_the_best(self):
        """A map of 38 cells has 20 radial frequencies."""
        method = ring(cells=38, candidates=3)
        places = [method.describe(make_scene(seed)) for seed in range(8)]
        database = method.build_database(places)
        query = method.describe(make_scene(3)[::2])
        scores = method.score(query, database, exhaustive=True)
        scores[np.argsort(scores)[:-3]] = np.nan
        found = method.score(query, database)
        np.testing.assert_array_equal(found, scores)


class TestRelativePose:
    @pytest.mark.parametrize(
        ("x", "y", "yaw_deg"),
        [
            (0.0, 0.0, 0.0),
            (5.0 * CELL, -2.0 * CELL, 0.0),
            (0.0, 0.0, 33.0),
            (0.0, 0.0, -87.0),
            (0.0, 0.0, 180.0),
            (3.0, -5.0, 120.0),
            (-6.0, 4.0, -153.0),
        ],
    )
    def test_a_known_motion(self, x, y, yaw_deg):
        method = ring()
        scan = make_scene(10)
        X_PQ = pose(x, y, yaw_deg)
        database = method.build_database([method.describe_place(scan)])
        query = method.describe(seen_from(X_PQ, scan))
        found = method.relative_pose(query, database, 0)
        error = np.linalg.inv(X_PQ) @ found
        assert abs(math.degrees(math.atan2(error[1, 0], error[0, 0]))) < 3.1
        assert abs(found[:2, 3] - X_PQ[:2, 3]).max() < 1.5 * CELL
        np.testing.assert_array_equal(found[2], [0.0, 0.0, 1.0, 0.0])

    def test_several_places_at_once(self):
        method = ring()
        scenes = [make_scene(seed) for seed in (10, 11)]
        nothing = np.empty((0, 3))
        database = method.build_database(
            [method.describe_place(s) for s in (*scenes, nothing)]
        )
        moved = seen_from(pose(3.0, -5.0, 120.0), scenes[0])
        query = method.describe(moved)
        found = method.relative_poses(query, database, [1, 2, 0, 0])
        assert found[1] is None
        for X_PQ, place in zip(found[::2], (1, 0), strict=True):
            alone = method.relative_pose(query, database, place)
            np.testing.assert_array_equal(X_PQ, alone)
        np.testing.assert_array_equal(found[3], found[2])

    def test_whole_cells_are_found_exactly(self):
        method = ring()
        scan = make_scene(11)
        X_PQ = pose(-7.0 * CELL, 4.0 * CELL, 0.0)
        database = method.build_database([method.describe_place(scan)])
        query = method.describe(seen_from(X_PQ, scan))
        found = method.relative_pose(query, database, 0)
        np.testing.assert_allclose(found, X_PQ, atol=1e-9)


def plain_pose(method, query, place):
    """Returns X_PQ by the definition, without anything kept or shared."""
    n = method.config.cells
    weights = np.full(n // 2 + 1, 2.0)
    weights[0] = 1.0
    if n % 2 == 0:
        weights[-1] = 1.0
    product = query.spectrum * place.spectrum.conj()
    product = product.reshape(6, -1, product.shape[1])
    rows = np.fft.irfft(product * weights[:, None], n=n, axis=2)
    shift = int(np.abs(rows).sum(axis=(0, 1)).argmax())
    yaw = -2.0 * math.pi * ((shift + n // 2) % n - n // 2) / n
    reference = place.bev(n).astype(np.float64)
    reference -= reference.mean()
    centre = 0.5 * (n - 1)
    u, v = np.meshgrid(np.arange(n) - centre, np.arange(n) - centre)
    best = (-1.0, 0.0, 0, 0)
    for heading in (yaw, yaw - math.pi):
        c, s = math.cos(heading), math.sin(heading)
        # Rows v are along x, columns u along y.
        row = np.rint(c * v + s * u + centre).astype(int)
        column = np.rint(c * u - s * v + centre).astype(int)
        inside = (row >= 0) & (row < n) & (column >= 0) & (column < n)
        turned = query.bev(n)[:, row % n, column % n] * inside
        turned = turned - turned.mean()
        found = np.fft.ifft2(
            np.fft.fft2(turned) * np.fft.fft2(reference).conj()
        )
        # The maps have the same norm at both headings.
        found = np.abs(found.real).sum(axis=0)
        at = np.unravel_index(found.argmax(), found.shape)
        if found[at] > best[0]:
            best = (found[at], heading, *at)
    _, heading, row, column = best
    cell = 2.0 * method.config.half_width / n
    x, y = (-((k + n // 2) % n - n // 2) * cell for k in (row, column))
    return pose(x, y, math.degrees(heading))


@pytest.mark.parametrize("cells", [60, 61])
@pytest.mark.parametrize("is_scored", [True, False])
def test_poses_are_those_of_the_definition(cells, is_scored):
    method = ring(cells=cells)
    scenes = [make_scene(seed) for seed in range(30, 36)]
    places = [method.describe_place(scene) for scene in scenes]
    database = method.build_database(places)
    for k, scene in enumerate(scenes):
        motion = pose(2.0 - k, 1.5 * k, 65.0 * k + 10.0)
        query = method.describe(seen_from(motion, scene))
        if is_scored:
            method.score(query, database)
        found = method.relative_poses(query, database, range(len(places)))
        expected = [plain_pose(method, query, place) for place in places]
        np.testing.assert_allclose(found, expected, atol=1e-9)


class TestConfig:
    @pytest.mark.parametrize(
        ("parameters", "fault"),
        [
            ({"half_width": -1.0}, "half_width"),
            ({"min_height": 12.0}, "min_height must be below max_height"),
            ({"neighbours": 1}, "neighbours"),
            ({"cells": 1.5}, "cells"),
            ({"cells": 1}, "cells"),
            ({"k": 30}, "no parameter 'k'"),
        ],
    )
    def test_faults(self, parameters, fault):
        with pytest.raises(InputError, match=fault):
            ring(**parameters)


def test_a_round_crop_shows_the_same_points_at_any_heading():
    corner, side = post(45.0, 45.0, 0.0, 2.0), post(50.0, 0.0, 0.0, 2.0)
    settings = {"half_width": 60.0, "neighbours": 2}
    both = np.concatenate([corner, side])
    assert_same = np.testing.assert_array_equal
    round_one = bev(both, crop="round", **settings)
    assert_same(round_one, bev(side, **settings))
    assert bev(corner, crop="square", **settings).any()
    assert not bev(corner, crop="round", **settings).any()
    # Exactly half a side away is outside, as on the square's edge.
    for reach, is_seen in ((59.999, True), (60.0, False)):
        edge = post(reach, 0.0, 0.0, 2.0)
        assert bev(edge, crop="round", **settings).any() == is_seen


def test_the_raster_has_the_symmetry_of_a_quarter_turn():
    """What a quarter turn costs comes from the angles alone.

    The program's angles hold the full turn twice, so that a quarter is 29.75
    of its steps; with 120 equal steps it would be a shift by 30 rows.
    """
    n = 120
    image = np.random.default_rng(3).random((n, n, 1))
    # x becomes y, y becomes -x.
    turned = image[::-1].transpose(1, 0, 2)
    differences = []
    for is_closed in (False, True):
        angles = np.linspace(0.0, 2.0 * math.pi, n, endpoint=is_closed)
        one, other = (
            np.abs(np.fft.rfft(radon(shown, angles), axis=1))
            for shown in (image, turned)
        )
        shifted = np.roll(one, 30, axis=0)
        differences.append(np.abs(shifted - other).max() / one.max())
    assert differences[0] < 1e-12
    assert differences[1] > 1e-3


@pytest.mark.slow
def test_a_corner_that_a_heading_turns_out_of_the_map():
    """A query there shows nothing in the map of another heading."""
    method = ring()
    query = method.describe(post(69.0, 69.0, 0.0, 2.0))
    places = [method.describe_place(make_scene(k)) for k in range(4)]
    database = method.build_database(places)
    for X_PQ in method.relative_poses(query, database, range(4)):
        assert np.isfinite(X_PQ).all()
