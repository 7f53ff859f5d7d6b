"""Training: batches, the network in JAX, the same seed, interruptions."""

import json

import numpy as np
import pytest

from cns_drake.scenarios import load_scenario, marked_yaml
from cns_drake.training import TrainingPlan, batches, descent
from cns_drake.training.batches import BatchSampler, TrainingScans
from cns_drake.training.descent import train
from cns_drake.training.network import features, scores, start_parameters
from cns_drake.training.sampled_city import SampledCity, draw_streets
from cns_drake.training.weights import MAPS, write_weights
from evaluation.base import InputError
from evaluation.methods import SECTORS
from evaluation.methods.learned import (
    CHANNELS,
    RINGS,
    Learned,
    LearnedConfig,
    LearnedScan,
)
from worlds.roads import draw_route, load_road_network


def toy_scans(num_cities=2, num_drives=2, length=60):
    """Drives past the same random walls, one a little beside the other."""
    parts = []
    for city in range(num_cities):
        rng = np.random.default_rng(city)
        images, xy, drives = [], [], []
        walls = rng.integers(0, 2, (length, RINGS, SECTORS, CHANNELS))
        for drive in range(num_drives):
            lost = rng.random(walls.shape) < 0.1
            images.append(np.where(lost, 0, 200 * walls).astype(np.uint8))
            x = 5.0 * np.arange(length)
            xy.append(np.stack([x, np.full(length, 2.0 * drive)], axis=1))
            drives.append(np.full(length, drive))
        parts.append(
            TrainingScans(
                np.concatenate(images),
                np.concatenate(xy),
                np.zeros(length * num_drives, int),
                np.concatenate(drives),
            )
        )
    return TrainingScans.joined(parts)


def test_batches_hold_what_they_say():
    scans = toy_scans()
    batch = BatchSampler(scans, seed=4).batch(9)
    num_queries, num_places = batch.weights.shape
    assert num_places == 2 * num_queries
    assert len(batch.images) == num_queries + num_places
    assert batch.weights.sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    assert batch.counts[batch.weights > 0.0].all()
    # The place that comes with a query is right, the next one is not.
    number = np.arange(num_queries)
    assert (batch.weights[number, 2 * number] > 0.0).all()
    assert (batch.weights[number, 2 * number + 1] == 0.0).all()
    again = BatchSampler(scans, seed=4).batch(9)
    assert np.array_equal(batch.images, again.images)
    other = BatchSampler(scans, seed=4).batch(10)
    assert not np.array_equal(batch.images, other.images)


def test_drives_that_never_meet_are_refused():
    with pytest.raises(InputError, match="no city has two drives"):
        BatchSampler(toy_scans(num_drives=1), seed=1)
    scans = toy_scans(num_cities=1)
    away = TrainingScans(
        scans.images,
        scans.xy + 100.0 * scans.drives[:, None],
        scans.cities,
        scans.drives,
    )
    with pytest.raises(InputError, match="hardly meet"):
        BatchSampler(away, seed=1).batch(0)


@pytest.mark.night
@pytest.mark.slow
def test_jax_scores_as_the_method_does(tmp_path):
    values = start_parameters(5)
    images = toy_scans(1, 1, 6).images
    write_weights(tmp_path / "w.npz", values, (0.0, 1.0), {"seed": 5})
    method = Learned(LearnedConfig(weights=tmp_path / "w.npz"))
    maps = np.asarray(features(values, images))
    described = []
    for image, one in zip(images, maps, strict=True):
        found = method.describe_image(image)
        assert found.features == pytest.approx(one, abs=1e-5)
        described.append(LearnedScan(one))
    expected = np.asarray(scores(maps, maps))
    database = method.build_database(described)
    for number, query in enumerate(described):
        assert method.score(query, database) == pytest.approx(
            expected[number], abs=1e-5
        )


@pytest.mark.slow
@pytest.mark.night
def test_the_same_seed_and_an_interruption(tmp_path, monkeypatch):
    import jax

    # The compilation of a step takes longest, and all three have the same one.
    steps = []
    jit = jax.jit

    def once(step):
        steps.append(jit(step))
        return steps[0]

    monkeypatch.setattr(jax, "jit", once)
    monkeypatch.setattr(descent, "_KEPT_EVERY", 2)
    monkeypatch.setattr(batches, "_CLUSTERS", 1)
    monkeypatch.setattr(descent, "_WARM_UP", 1)
    scans = toy_scans(length=20)
    batch = BatchSampler(scans, 1).batch(0)
    # One batch, again and again, so that its loss falls.
    monkeypatch.setattr(BatchSampler, "batch", lambda self, step: batch)
    whole, curve = train(scans, 5, 1, tmp_path / "whole.npz")
    assert curve.shape == (5, 2)
    assert curve[-1, 0] < curve[0, 0]

    def stop(step, values):
        if step == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(scans, 5, 1, tmp_path / "cut.npz", on_step=stop)
    seen = []
    resumed, again = train(
        scans,
        5,
        1,
        tmp_path / "cut.npz",
        on_step=lambda step, values: seen.append(step),
    )
    assert seen == [5]
    assert again == pytest.approx(curve, abs=1e-4)
    for name, one in whole.items():
        assert resumed[name] == pytest.approx(one, abs=1e-4)
    with pytest.raises(InputError, match="another training"):
        train(scans, 6, 1, tmp_path / "cut.npz")


def test_weights_say_what_made_them(tmp_path):
    path = tmp_path / "w.npz"
    write_weights(path, start_parameters(1), (0.25, 1.0), {"command": "x"})
    with np.load(path, allow_pickle=False) as file:
        assert json.loads(str(file["made_by"])) == {"command": "x"}
        assert file["seen"].tolist() == [0.25, 1.0]
    Learned(LearnedConfig(weights=path))


def test_plans_of_minutes():
    plan = TrainingPlan.of_minutes(10.0, seed=3, change=False)
    assert (plan.cities, plan.steps) == (3, 600)
    drawn = plan.drawn()
    assert [one.map_name for one in drawn] == list(MAPS)
    assert "metropolis" not in MAPS
    assert len({one.city_seed for one in drawn}) == 3
    assert all(one.city_seed > 100_000 and not one.change for one in drawn)
    assert TrainingPlan.of_minutes(10.0, cities=5).cities == 5


def test_lidars_of_the_users():
    """Each drive has one of them, and nothing else changes."""
    sheet = {
        "rings_deg": [[10.0, -10.0, 48]],
        "columns": 512,
        "ranges": [0.5, 60.0],
        "source": "mine",
    }
    base = load_scenario("riverside_01")
    usual = SampledCity("riverside", 1, 0, 12)
    own = TrainingPlan(1, 1, lidars=("vlp-16", sheet)).drawn()[0]
    rings = set()
    for number in range(12):
        first, second = (one._drive(base, number) for one in (usual, own))
        assert first.replaced(lidars=second.lidars) == second
        rings.add(second.lidars["lidar"].sheet.num_rings)
    assert rings == {16, 48}


def test_graded_batches_rank_by_overlap():
    scans = toy_scans()
    other = scans.drives[:, None] != scans.drives
    same = scans.cities[:, None] == scans.cities
    apart = np.linalg.norm(scans.xy[:, None] - scans.xy, axis=2)
    # Those 20 m ahead share more than those beside, which a radius calls right.
    shared = other * same * np.exp(-np.abs(apart - 20.1) / 100.0)
    graded = TrainingScans(
        scans.images, scans.xy, scans.cities, scans.drives, shared
    )
    batch = BatchSampler(graded, seed=4).batch(9)
    assert batch.counts.all()
    assert batch.weights.sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    number = np.arange(len(batch.weights))
    assert (batch.weights[number, 2 * number] > 0.0).all()
    best = batch.weights.max(axis=1)
    assert (batch.weights[number, 2 * number + 1] < best).all()


def test_drawn_streets_are_no_map_and_can_be_driven(tmp_path):
    found = []
    for number in range(5):
        rng = np.random.default_rng([3, number])
        roads = tmp_path / f"roads_{number}.yaml"
        roads.write_bytes(marked_yaml("streets", draw_streets(rng)))
        network = load_road_network(roads)
        assert len(draw_route(network, 1600.0, rng).root) > 3
        found.append(roads.read_bytes())
    assert len(set(found)) == 5
