"""Two small maps with labels at random."""

import numpy as np

from evaluation.map_update import PairLabels, read_pair, write_labels


def write_map(folder, points):
    """Writes a map by another program's means: text, coordinates only."""
    folder.mkdir(parents=True)
    rows = "\n".join(" ".join(map(repr, row)) for row in points.tolist())
    (folder / "map.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"end_header\n{rows}\n"
    )


def clouds(folder, seed=3, size=400):
    """Two maps of random points with random labels; returns pair and truth."""
    rng = np.random.default_rng(seed)
    truth = []
    for side, labels in (("A", [0, 1, 2]), ("B", [1, 3, 4])):
        write_map(folder / side, rng.uniform(0.0, 9.0, (size, 3)))
        chosen = rng.choice(labels, size).astype(np.uint8)
        write_labels(folder / side / "truth.npy", chosen)
        truth.append(chosen)
    return read_pair(folder), PairLabels(*truth)
