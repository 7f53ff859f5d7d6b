"""The section in which a reader looks at each query, and its data."""

import base64
from collections.abc import Mapping, Sequence
import zlib

import numpy as np

from evaluation.maps import CELL, HEIGHT_STEP, MAX_POINTS
from evaluation.recognition import FAULTS, PlaceOutcome
from evaluation.results.method_names import in_table_order, title
from evaluation.results.page_frame import PageSection, page_section
from evaluation.results.sections.routes import PageDrive

# Points in all scans of a page. At some 3 bytes each they leave room for the
# figures within 25 MB.
_POINTS_OF_A_PAGE = 5_000_000
# Images of cameras in a page [bytes].
_IMAGES_OF_A_PAGE = 6_000_000


def browser_section(
    outcomes: Sequence[Sequence[PlaceOutcome]],
    drives: Mapping[str, PageDrive],
    pages: Mapping[str, str],
) -> PageSection:
    """Returns the query browser.

    Args:
        outcomes: for each pair of drives, the outcome of each method.
        drives: name of a drive -> its data for the page.
        pages: name of a drive -> address of the web page of its recording.
            Drives can be absent.
    """
    data = browser_data(outcomes, drives, pages)
    return page_section(
        "browser",
        "Queries",
        "queries.csv: the first protocol, with the change, verified 0",
        is_open=True,
        data=data,
        image_step=data["imageStep"],
        # Without a match in the database, no answer is wrong.
        fault_kinds={
            kind: kind.replace("_", " ")
            for kind in FAULTS
            if kind not in ("no_place", "other_city")
        },
    )


def browser_data(
    outcomes: Sequence[Sequence[PlaceOutcome]],
    drives: Mapping[str, PageDrive],
    pages: Mapping[str, str],
) -> dict:
    """Returns the data of the query browser, ready for JSON.

    Top views of the maps are not included: the browser uses the top views in
    the section with the routes. The arguments are the same as for
    `browser_section`.
    """
    used = {
        name
        for of_pair in outcomes
        for name in (of_pair[0].database, of_pair[0].query)
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
        "pairs": [_pair_data(of_pair, drives) for of_pair in outcomes],
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
    results: Sequence[PlaceOutcome], drives: Mapping[str, PageDrive]
) -> dict:
    by_method = {result.method: result for result in results}
    first = results[0]
    database, query = drives[first.database], drives[first.query]
    rows, places = first.matches.T
    return {
        "label": f"{first.database} → {first.query}",
        "database": first.database,
        "query": first.query,
        "places": np.searchsorted(database.frames, first.place_frames).tolist(),
        "queries": np.searchsorted(
            query.frames, first.outcomes.columns["query_frame"]
        ).tolist(),
        "matches": [
            places[rows == row].tolist() for row in range(len(first.outcomes))
        ],
        "methods": [
            _method_data(by_method[method])
            for method in in_table_order(by_method)
        ],
    }


def _method_data(result: PlaceOutcome) -> dict:
    best, values = [], []
    for places, scores in zip(
        result.best_places, result.best_scores, strict=True
    ):
        is_candidate = places >= 0
        best.append(places[is_candidate].tolist())
        values.append(np.round(scores[is_candidate], 4).tolist())
    return {
        "name": result.method,
        "title": title(result.method),
        "best": best,
        "scores": values,
        "ranks": result.outcomes.known_ranks,
        "why": result.outcomes.columns["why"].tolist(),
        "auc": round(result.outcomes.curve.auc, 4),
    }
