"""Data for the script of a report's page: drives, and pairs of drives."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import io
import zlib

from matplotlib import image
import numpy as np

from evaluation.drives.sampling import sample_frames
from evaluation.maps.thumbnails import CELL, HEIGHT_STEP, MAX_POINTS
from evaluation.recognition.fault_names import PairEvidence, fault_kinds
from evaluation.recognition.metrics import MODES
from evaluation.recognition.place_outcome import PlaceOutcome
from evaluation.report.camera_images import CameraImages
from evaluation.report.point_rendering import Picture
from evaluation.results.table_forms import by_pair, in_table_order, title

# Points in all scans of a page. At some 3 bytes each they leave room for the
# figures within 25 MB.
_POINTS_OF_A_PAGE = 5_000_000
# Images of cameras in a page [bytes].
_IMAGES_OF_A_PAGE = 6_000_000
# Between the points of a drawn route [m].
_ROUTE_STEP = 2.0
# Quality of compressed pictures, from 0 to 100.
_WEBP_QUALITY = 75


@dataclass(frozen=True)
class PageDrive:
    """A drive as the page shows it.

    Attributes:
        frames: (K,) frames that are places or queries, increasing.
        X_WS: (K, 4, 4) poses of the sensor at these frames.
        route: (M, 2) the path of the sensor from above [m].
        thumbnails: K reduced scans (see `evaluation.maps.thumbnails`).
        view: the map from above, as a WebP file.
        extent: left, right, bottom and top of the view [m].
        images: images of the drive's camera at the frames, if the drive has a
            camera.
        name: name of the drive.
    """

    name: str
    frames: np.ndarray
    X_WS: np.ndarray
    route: np.ndarray
    thumbnails: list[np.ndarray]
    view: bytes
    extent: tuple[float, float, float, float]
    images: CameraImages | None = None


def make_page_drive(
    name: str,
    view: Picture,
    X_WS: np.ndarray,
    frames: Sequence[int],
    thumbnails: list[np.ndarray],
    images: CameraImages | None = None,
) -> PageDrive:
    """Returns a drive as the page shows it.

    Args:
        name: name of the drive.
        view: picture of the drive's stage from above.
        X_WS: (N, 4, 4) poses of the LiDAR at all frames.
        frames: numbers of the K frames that are places or queries.
        thumbnails: K reduced scans, one for each of these frames.
        images: images of the drive's camera at these frames, if the drive has a
            camera.
    """
    positions = X_WS[:, :3, 3]
    stream = io.BytesIO()
    image.imsave(
        stream, view.image, format="webp", pil_kwargs={"quality": _WEBP_QUALITY}
    )
    chosen = np.array(frames, dtype=np.int64)
    return PageDrive(
        name=name,
        frames=chosen,
        X_WS=X_WS[chosen],
        route=positions[sample_frames(positions, _ROUTE_STEP), :2],
        thumbnails=thumbnails,
        view=stream.getvalue(),
        extent=view.extent,
        images=images,
    )


def browser_data(
    recognitions: Sequence[PlaceOutcome],
    drives: Mapping[str, PageDrive],
    changes: Mapping[tuple[str, str, str], float],
    pages: Mapping[str, str],
    evidence: Mapping[tuple[str, str], PairEvidence],
) -> dict:
    """Returns the data of the query browser, ready for JSON.

    Top views of the maps are not included: the browser uses the top views in
    the pictures that `evaluation.report.route_pictures.route_picture` makes.

    Args:
        recognitions: results of methods on pairs of drives.
        drives: name of a drive -> its data for the page.
        changes: map, database and query -> change between the drives.
        pages: name of a drive -> the web page of the drive. Drives can be
            absent.
        evidence: names of database and query -> why queries failed. Pairs can
            be absent.
    """
    used = {
        name
        for result in recognitions
        for name in (result.database, result.query)
    }
    num_scans = sum(len(drives[name].frames) for name in used)
    num_points = min(MAX_POINTS, _POINTS_OF_A_PAGE // max(num_scans, 1))
    images = {
        name: images_of_drive
        for name in used
        if (images_of_drive := drives[name].images)
    }
    num_bytes = sum(
        len(content)
        for of_drive in images.values()
        for content in of_drive.files
    )
    image_step = 1 + num_bytes // _IMAGES_OF_A_PAGE
    return {
        "radius": recognitions[0].protocol.radius,
        "cell": CELL,
        "heightStep": HEIGHT_STEP,
        "imageStep": image_step,
        "drives": {
            name: _drive_data(drives[name], num_points)
            | {
                "page": pages.get(name),
                "images": images[name].to_data(image_step)
                if name in images
                else None,
            }
            for name in sorted(used)
        },
        "pairs": [
            _pair_data(pair, results, drives, changes.get(pair), evidence)
            for pair, results in by_pair(recognitions).items()
        ],
    }


def _drive_data(drive: PageDrive, num_points: int) -> dict:
    # Sorted points have similar neighbours, which compress well.
    scans = [
        points[np.lexsort(points.T[::-1])]
        for points in (whole[:num_points] for whole in drive.thumbnails)
    ]
    planes = np.concatenate(scans).T.tobytes() if scans else b""
    yaws = np.arctan2(drive.X_WS[:, 1, 0], drive.X_WS[:, 0, 0])
    return {
        "x": np.round(drive.X_WS[:, 0, 3], 2).tolist(),
        "y": np.round(drive.X_WS[:, 1, 3], 2).tolist(),
        "z": np.round(drive.X_WS[:, 2, 3], 2).tolist(),
        "yaw": np.round(yaws, 3).tolist(),
        "frames": drive.frames.tolist(),
        "route": np.round(drive.route, 1).tolist(),
        "extent": np.round(drive.extent, 3).tolist(),
        "counts": [len(points) for points in scans],
        "points": base64.b64encode(zlib.compress(planes, 9)).decode("ascii"),
    }


def _pair_data(
    pair: tuple[str, str, str],
    results: Sequence[PlaceOutcome],
    drives: Mapping[str, PageDrive],
    change: float | None,
    evidence: Mapping[tuple[str, str], PairEvidence],
) -> dict:
    by_method = {result.method: result for result in results}
    first = results[0]
    database, query = drives[first.database], drives[first.query]
    rows, places = first.matches.T
    if change is not None:
        change = None if np.isnan(change) else round(change, 4)
    return {
        "map": pair[0],
        "label": f"{pair[0]} {pair[1]} → {pair[2]}",
        "database": first.database,
        "query": first.query,
        "change": change,
        "places": np.searchsorted(database.frames, first.place_frames).tolist(),
        "queries": np.searchsorted(
            query.frames, first.columns["query_frame"]
        ).tolist(),
        "matches": [
            places[rows == row].tolist() for row in range(len(first.outcomes))
        ],
        "methods": [
            _method_data(
                by_method[method], evidence.get((first.database, first.query))
            )
            for method in in_table_order(by_method)
        ],
    }


def _method_data(result: PlaceOutcome, evidence: PairEvidence | None) -> dict:
    best, values = [], []
    for places, scores in zip(
        result.best_places, result.best_scores, strict=True
    ):
        is_candidate = places >= 0
        best.append(places[is_candidate].tolist())
        values.append(np.round(scores[is_candidate], 4).tolist())
    metrics = {
        mode: {
            "auc": round(result.by_mode[mode].auc, 4),
            "f1": round(result.by_mode[mode].f1_max, 4),
        }
        for mode in MODES
    }
    recall = result.by_mode[MODES[0]].recall_at_1
    return {
        "name": result.method,
        "title": title(result.method),
        "best": best,
        "scores": values,
        "ranks": result.outcomes.known_ranks,
        "why": fault_kinds(result, evidence) if evidence else None,
        "metrics": metrics,
        "recall": None if np.isnan(recall) else round(recall, 4),
    }
