"""Echoes against a plain account of them, beam by beam."""

import numpy as np
import pytest

from cns_drake.sensors import Echoes
from cns_drake.sensors.returns.echoes import Receiver, report_echoes
from cns_drake.sensors.returns.light import Light
from cns_drake.sensors.returns.link_budget import fit_link_budget
from cns_drake.sensors.returns.random_numbers import frame_key
from evaluation.lidar_sheets import LIDAR_PRESETS, Response

BEAMS = 300
# More are not processed.
MOST = 12
EXACT = Response(gain=0.0, speckle=0.0)


def accounts(light, receiver):
    """Yields (distance, SNR, energy, geometry) of each beam's echoes."""
    budget, extinction = receiver.budget, receiver.extinction
    for beam in range(BEAMS):
        rows = np.flatnonzero(light.beam == beam)
        rows = rows[np.argsort(light.distance[rows], kind="stable")]
        groups = []
        for k in rows:
            d = light.distance[k]
            loss = np.exp(-2 * (extinction + budget.own_extinction) * d)
            part = (d, budget.scale * light.energy[k] * loss / d**2, k)
            if groups and d - groups[-1][0][0] <= receiver.sheet.resolution:
                groups[-1].append(part)
            else:
                groups.append([part])
        echoes = []
        for group in groups[:MOST]:
            d, snr, k = map(np.array, zip(*group, strict=True))
            total = snr.sum()
            mean = (snr * d).sum() / snr.sum()
            # As in clear air.
            gain = np.exp(2 * budget.own_extinction * mean)
            energy = total * mean**2 * gain / budget.scale
            brightest = light.geometry[k[snr.argmax()]]
            echoes.append((mean, total, energy, brightest))
        yield beam, echoes


@pytest.mark.parametrize("extinction", [0.0, 0.004])
@pytest.mark.parametrize("choice", ["first", "strongest", "last"])
def test_they_are_those_of_a_plain_account(choice, extinction):
    rng = np.random.default_rng(7)
    count = 3000
    light = Light(
        rng.integers(0, rng.choice([30, BEAMS], count)),
        rng.uniform(5.0, 60.0, count),
        rng.uniform(0.05, 0.25, count),
        rng.integers(0, 1000, count).astype(np.int32),
    )
    # Pairs on both sides of a pulse's length.
    sheet = LIDAR_PRESETS["vlp-16"].returns.replaced(
        range_noise=0.0, range_floor=0.0, response=EXACT
    )
    near = rng.permutation(count)[:1000]
    moved = light.distance[near] + sheet.resolution * rng.uniform(
        0.5, 1.5, 1000
    )
    light = Light(*(np.concatenate([one, one[near]]) for one in light))
    light.distance[count:] = moved
    budget = fit_link_budget(sheet)
    budget = budget._replace(scale=100.0 * budget.scale)
    receiver = Receiver(
        sheet, budget, extinction, 0.5, 200.0, Echoes(choice), None
    )
    reported = report_echoes(
        light, receiver, frame_key(3, "", 0), np.zeros(BEAMS), np.ones(BEAMS)
    )
    pick = {
        "first": lambda echoes: echoes[0],
        "last": lambda echoes: echoes[-1],
        "strongest": lambda echoes: max(echoes, key=lambda echo: echo[1]),
    }[choice]
    found = [
        (beam, len(echoes), *pick(echoes))
        for beam, echoes in accounts(light, receiver)
        if echoes
    ]
    beam, number, distance, _, energy, geometry = map(
        np.array, zip(*found, strict=True)
    )
    assert number.max() == MOST
    np.testing.assert_array_equal(reported.beam, beam)
    np.testing.assert_allclose(reported.distance, distance, rtol=1e-6)
    np.testing.assert_array_equal(reported.geometry, geometry)
    expected = np.rint(sheet.retro_from * energy)
    np.testing.assert_array_equal(reported.intensity, expected)
    assert np.ptp(expected) > 5.0
