"""Reading pages of `static_page` with a decoder of their own."""

import base64
import re
import struct
import zlib

import numpy as np


def read_commands(html):
    """Returns the decoded commands of a page, in their order."""
    return [_Decoder(data).value() for data in read_messages(html)]


def read_messages(html):
    """Returns the bytes of each command of a page, in their order."""
    return [
        _unfiltered(zlib.decompress(base64.b64decode(data)), length)
        for data, length in re.findall(
            r'enqueue\("([A-Za-z0-9+/=]*)"(?:, (\d+))?\)', html
        )
    ]


def _unfiltered(data, length):
    """Sums up rows of 12 bytes, which come column by column."""
    if not length:
        return data
    columns = np.frombuffer(data, np.uint8).reshape(12, -1)
    return np.cumsum(columns, axis=1, dtype=np.uint8).T.tobytes()[: int(length)]


def objects(commands):
    """Returns path -> geometry."""
    return {
        command["path"]: command["object"]["geometries"][0]
        for command in commands
        if command["type"] == "set_object" and "geometries" in command["object"]
    }


def vertices(geometry):
    """Returns the (N, 3) positions of a buffer geometry."""
    return geometry["data"]["attributes"]["position"]["array"].reshape(-1, 3)


def colors(geometry):
    """Returns the (N, 3) colours of a buffer geometry, linear light."""
    return geometry["data"]["attributes"]["color"]["array"].reshape(-1, 3)


def properties(commands):
    """Returns (path, property) -> its last value."""
    return {
        (command["path"], command["property"]): command["value"]
        for command in commands
        if command["type"] == "set_property"
    }


def tracks(commands):
    """Returns path -> track name -> (times, values) of the animation."""
    (animation,) = (c for c in commands if c["type"] == "set_animation")
    return {
        entry["path"]: {
            track["name"]: track["keys"] for track in entry["clip"]["tracks"]
        }
        for entry in animation["animations"]
    }


# MessagePack's codes of numbers, and of values that begin with a length.
_FORMATS = {
    0xCA: ">f", 0xCB: ">d", 0xCC: ">B", 0xCD: ">H", 0xCE: ">I",
    0xCF: ">Q", 0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q",
}  # fmt: skip
_LENGTHS = {
    0xC4: ">B", 0xC5: ">H", 0xC6: ">I", 0xC7: ">B", 0xC8: ">H",
    0xC9: ">I", 0xD9: ">B", 0xDA: ">H", 0xDB: ">I", 0xDC: ">H",
    0xDD: ">I", 0xDE: ">H", 0xDF: ">I",
}  # fmt: skip
# Typed arrays, as MessagePack extensions of meshcat.
_ARRAYS = {0x12: "<u1", 0x15: "<i4", 0x16: "<u4", 0x17: "<f4"}


class _Decoder:
    """As much of MessagePack as Meshcat writes."""

    def __init__(self, data):
        self._data = data
        self._at = 0

    def value(self):
        code = self._number(">B")
        if code < 0x80:
            return code
        if code < 0x90:
            return self._map(code & 0x0F)
        if code < 0xA0:
            return self._array(code & 0x0F)
        if code < 0xC0:
            return self._bytes(code & 0x1F).decode()
        if code >= 0xE0:
            return code - 0x100
        if code in (0xC0, 0xC2, 0xC3):
            return {0xC0: None, 0xC2: False, 0xC3: True}[code]
        if code in _FORMATS:
            return self._number(_FORMATS[code])
        length = self._number(_LENGTHS[code])
        if code <= 0xC6:
            return self._bytes(length)
        if code <= 0xC9:
            kind = self._number(">B")
            return np.frombuffer(self._bytes(length), _ARRAYS[kind])
        if code <= 0xDB:
            return self._bytes(length).decode()
        return self._array(length) if code <= 0xDD else self._map(length)

    def _number(self, form):
        (number,) = struct.unpack_from(form, self._data, self._at)
        self._at += struct.calcsize(form)
        return number

    def _bytes(self, length):
        self._at += length
        return self._data[self._at - length : self._at]

    def _array(self, length):
        return [self.value() for _ in range(length)]

    def _map(self, length):
        return {self.value(): self.value() for _ in range(length)}
