"""Where the textures of surfaces lie on triangles."""

import numpy as np


def repeated_coordinates(
    corners: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Returns coordinates in metres, for textures that are repeated.

    On walls, the rows of a texture are horizontal. Divided by the size of a
    texture, the results are texture coordinates.

    Args:
        corners: (N, 3, 3) corners of the triangles [m].
        normals: (N, 3) unit normals of the triangles.

    Returns:
        (N, 3, 2) coordinates of the corners: to the right and downwards [m].
    """
    across = np.round(np.stack([-normals[:, 1], normals[:, 0]], axis=1), 3)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    is_flat = length[:, 0] < 0.5
    across = np.where(is_flat[:, None], (1.0, 0.0), across / (length + 1e-9))
    along = np.einsum("nca,na->nc", corners[:, :, :2], across)
    height = np.where(is_flat[:, None], corners[:, :, 1], corners[:, :, 2])
    return np.stack([along, -height], axis=2)


def face_coordinates(
    corners: np.ndarray, normals: np.ndarray, owners: np.ndarray
) -> np.ndarray:
    """Returns texture coordinates with which one texture covers each geometry.

    Args:
        corners: (N, 3, 3) corners of the triangles of all geometries [m].
        normals: (N, 3) unit normals of the triangles.
        owners: (N,) index of each triangle's geometry.

    Returns:
        (N, 3, 2) texture coordinates of the corners, which run from 0 to 1 over
        each geometry.
    """
    low = np.full((owners.max() + 1, 3), np.inf)
    high = -low
    np.minimum.at(low, owners, corners.min(axis=1))
    np.maximum.at(high, owners, corners.max(axis=1))
    middle = (low + high) / 2.0
    tiles = repeated_coordinates(corners - middle[owners][:, None], normals)
    half = np.full((len(middle), 2), 1e-3)
    np.maximum.at(half, owners, np.abs(tiles).max(axis=1))
    return 0.5 + 0.5 * tiles / half[owners][:, None]
