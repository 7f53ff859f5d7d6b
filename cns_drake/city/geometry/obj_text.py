"""The text of an OBJ file, from whole millimetres and numbers of corners."""

from __future__ import annotations

import numpy as np

from cns_drake.base.compiled import compiled

# The longest number: a sign, 19 digits and a point.
_LONGEST = 21
_ZERO, _MINUS, _POINT, _SPACE, _LINE_END = map(ord, "0-. \n")
_VERTEX, _FACE = map(ord, "vf")


def obj_text(vertices: np.ndarray, corners: np.ndarray) -> bytes:
    """Returns vertices and faces as lines.

    Args:
        vertices: (N, 3) int64, in thousandths.
        corners: (F, 4) int64 numbers of the corners of each face, from 1 on;
            a corner may follow itself. Faces of fewer than three different
            ones after each other are left out.
    """
    room = np.empty(
        (3 * _LONGEST + 5) * len(vertices) + (4 * _LONGEST + 6) * len(corners),
        np.uint8,
    )
    length = _write_lines(
        np.ascontiguousarray(vertices), np.ascontiguousarray(corners), room
    )
    return room[:length].tobytes()


@compiled
def _write_lines(
    vertices: np.ndarray, corners: np.ndarray, room: np.ndarray
) -> int:
    """Writes the lines; returns their length.

    Args:
        vertices, corners: see `obj_text`.
        room: for the text.
    """
    place = 0
    for k in range(len(vertices)):
        room[place] = _VERTEX
        place += 1
        for axis in range(3):
            room[place] = _SPACE
            place = _write_decimal(vertices[k, axis], room, place + 1)
        room[place] = _LINE_END
        place += 1
    for k in range(len(corners)):
        number = 0
        for j in range(4):
            number += corners[k, j] != corners[k, j - 1]
        if number < 3:
            continue
        room[place] = _FACE
        place += 1
        for j in range(4):
            if corners[k, j] != corners[k, j - 1]:
                room[place] = _SPACE
                place = _write_whole(corners[k, j], room, place + 1)
        room[place] = _LINE_END
        place += 1
    return place


@compiled
def _write_decimal(thousandths: int, room: np.ndarray, place: int) -> int:
    """Writes thousandths as a decimal number; returns the place behind it."""
    if thousandths < 0:
        room[place] = _MINUS
        place += 1
        thousandths = -thousandths
    place = _write_whole(thousandths // 1000, room, place)
    rest = thousandths % 1000
    if rest:
        room[place] = _POINT
        place += 1
        step = 100
        while rest:
            room[place] = _ZERO + rest // step
            place += 1
            rest %= step
            step //= 10
    return place


@compiled
def _write_whole(number: int, room: np.ndarray, place: int) -> int:
    """Writes a number that is not negative; returns the place behind it."""
    end, left = place + 1, number // 10
    while left:
        end += 1
        left //= 10
    for k in range(end - 1, place - 1, -1):
        room[k] = _ZERO + number % 10
        number //= 10
    return end
