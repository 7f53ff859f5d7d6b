"""Recorded traffic of small maps, written as the shipped files are."""

import numpy as np

PERIOD = 0.5
UNITS = np.array([5e-3, 5e-3, 5e-3, 1e-3, 1e-3])


def write_recorded(path, vehicles, walkers, kinds=None):
    """Writes coordinates (K, N, 5) and (K, M, 4), `PERIOD` apart.

    All vehicles are saloons, unless their kinds are given.
    """
    arrays = {}
    for name, values in (("vehicles", vehicles), ("walkers", walkers)):
        rows = np.rint(values / UNITS[: values.shape[2]]).astype(int)
        twice = np.diff(rows, axis=0, prepend=0)
        twice = np.diff(twice, axis=0, prepend=0).transpose(2, 1, 0)
        arrays[f"{name}_start"] = twice[..., :2].astype("<i4")
        arrays[name] = twice[..., 2:].astype("<i2")
    np.savez_compressed(
        path,
        period=np.array(PERIOD),
        units=UNITS,
        kinds=np.array(kinds or ["saloon"] * vehicles.shape[1]),
        **arrays,
    )


def write_rounds(path, vehicles=20, walkers=60, seconds=60.0):
    """Writes traffic that goes round and round on circles of its own.

    The circles lie around (50, 10), the middle of the small city.
    """
    t = np.arange(0.0, seconds + PERIOD / 2, PERIOD)[:, None]
    found = []
    for number, first, speed in ((vehicles, 20.0, 7.0), (walkers, 8.0, 1.3)):
        radius = first + 1.5 * np.arange(number)
        angle = 2.4 * np.arange(number) + speed / radius * t
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        rows = [50.0 + x, 10.0 + y, 0.0 * x, angle + np.pi / 2, 0.0 * x]
        found.append(np.stack(rows, axis=2))
    kinds = ["saloon", "bus", "bicycle", "motorcycle"] * vehicles
    write_recorded(path, found[0], found[1][..., :4], kinds[:vehicles])
