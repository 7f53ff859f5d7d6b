"""Compares scans of an imported city with rays on its source's polygons.

    python tests/benchmarks/source_rays.py MAP CITY.json [--rays N]

MAP is an import of CITY.json, CityJSON whose buildings are solids, made with
`--plain`. Returns on buildings, N of every 75th frame of its first drive, are
cast again: on the polygons of the file, each on the plane that fits its corners
best. Prints each ray that differs by over 0.1 m, with the greatest distance of
the face's corners from that plane, and what part of the difference lies across
the face; the latter is less than the former where the face is not plane.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import Polygon
import yaml

from cns_drake.scenarios import load_scenario
from cns_drake.simulation import SimulationSource

_BUILDING = 50
_EVERY = 75
_DIFFERENCE = 0.1
# Boxes about faces are larger by this much, so that no ray slips by [m].
_SLACK = 0.02


class Polygons:
    """The faces of all solids of buildings, in metres from an origin."""

    def __init__(self, path: Path, origin: list[float]):
        city = json.loads(path.read_text())
        move = city["transform"]
        vertices = np.array(city["vertices"]) * move["scale"]
        vertices += np.array(move["translate"]) - origin
        self.faces = [
            [vertices[ring] for ring in face]
            for one in city["CityObjects"].values()
            if one["type"].startswith("Building")
            for geometry in one.get("geometry", [])
            for shell in geometry["boundaries"]
            for face in shell
        ]
        outer = [face[0] for face in self.faces]
        self._middles = np.array([ring.mean(axis=0) for ring in outer])
        self._normals = np.array(
            [np.linalg.svd(ring - ring.mean(axis=0))[2][2] for ring in outer]
        )
        self._low = np.array([ring.min(axis=0) for ring in outer]) - _SLACK
        self._high = np.array([ring.max(axis=0) for ring in outer]) + _SLACK

    def cast(self, p_WS: np.ndarray, ray_W: np.ndarray) -> tuple[float, int]:
        """Returns the range [m] of the nearest hit (inf: none) and its face."""
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = (self._low - p_WS) / ray_W, (self._high - p_WS) / ray_W
        enter = np.minimum(*sides).max(axis=1)
        leave = np.maximum(*sides).min(axis=1)
        near = np.flatnonzero(leave >= np.maximum(enter, 0.0))
        slope = self._normals[near] @ ray_W
        near, slope = near[slope != 0.0], slope[slope != 0.0]
        to_plane = (self._middles[near] - p_WS) * self._normals[near]
        ranges = to_plane.sum(axis=1) / slope
        for k in np.argsort(ranges).tolist():
            if ranges[k] > 0.0 and self._holds(
                int(near[k]), p_WS + ranges[k] * ray_W
            ):
                return float(ranges[k]), int(near[k])
        return np.inf, -1

    def bend(self, face: int) -> float:
        """Returns how far the farthest corner is from the face's plane [m]."""
        offsets = self.faces[face][0] - self._middles[face]
        return float(np.abs(offsets @ self._normals[face]).max())

    def across(self, face: int, ray_W: np.ndarray) -> float:
        """Returns the cosine of a ray's incidence on a face."""
        return float(abs(self._normals[face] @ ray_W))

    def _holds(self, face: int, point: np.ndarray) -> bool:
        axes = np.argsort(np.abs(self._normals[face]))[:2]
        outer, *holes = (ring[:, axes] for ring in self.faces[face])
        polygon = shapely.make_valid(Polygon(outer, holes))
        return bool(shapely.intersects_xy(polygon, *point[axes]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", type=Path)
    parser.add_argument("city", type=Path)
    parser.add_argument("--rays", type=int, default=60, help="of a frame")
    options = parser.parse_args()
    origin = yaml.safe_load((options.map / "import.yaml").read_text())["origin"]
    polygons = Polygons(options.city, origin)
    drive = SimulationSource(load_scenario(options.map / "sequence_01.yaml"))()
    rng = np.random.default_rng(0)
    differences = []
    for frame in range(0, len(drive), _EVERY):
        scan = drive.scan(frame)
        scan = rng.permutation(scan[scan["label"] == _BUILDING])[: options.rays]
        points = np.stack([scan[axis] for axis in "xyz"], axis=1).astype(float)
        X_WS = drive.X_WS[frame]
        for point in points:
            distance = float(np.linalg.norm(point))
            ray_W = X_WS[:3, :3] @ point / distance
            found, face = polygons.cast(X_WS[:3, 3], ray_W)
            differences.append(abs(found - distance))
            if differences[-1] > _DIFFERENCE:
                text = f"frame {frame}: {distance:.3f} m, source {found:.3f} m"
                if face >= 0:
                    across = differences[-1] * polygons.across(face, ray_W)
                    text += (
                        f"; across the face {across:.4f} m, its corners within "
                        f"{polygons.bend(face):.4f} m of a plane"
                    )
                print(text)
    print(
        f"{len(differences)} rays, {np.mean(np.array(differences) > 0.001):.2%}"
        f" off by over 1 mm, median {np.median(differences):.6f} m"
    )


if __name__ == "__main__":
    main()
