"""GLB, the binary container of glTF 2.0: a JSON document and one block of numbers.

Source: Khronos glTF 2.0 specification, sections 3.6 (accessors) and 4 (GLB).
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say

Array = NDArray[np.float64]

MAX_BYTES = 1 << 30
FLOAT = 5126
_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
_SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", FLOAT: "<f4"}
_AGAIN = "Export it again from the program it came from."


class Numbers:
    """The block of numbers while it is put together, with the accessors that describe it."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []

    def add(self, values: NDArray[np.floating], bounds: bool = False) -> int:
        """Add one array, (T,) or (T, 3) or (T, 4); gives the index of its accessor."""
        data = np.ascontiguousarray(values, dtype="<f4")
        kind = "SCALAR" if data.ndim == 1 else f"VEC{data.shape[1]}"
        accessor: dict[str, Any] = {
            "bufferView": len(self.views), "componentType": FLOAT, "count": len(data), "type": kind
        }  # fmt: skip
        if bounds:
            rows = data.reshape(len(data), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.views.append({"buffer": 0, "byteOffset": self._length, "byteLength": data.nbytes})
        self.accessors.append(accessor)
        self._parts.append(data.tobytes())
        self._length += data.nbytes
        return len(self.accessors) - 1

    def add_whole(self, values: NDArray[np.unsignedinteger]) -> int:
        """Add whole numbers of 2 or 4 bytes, (T,) or (T, 4), as indices and joints are kept."""
        data = np.ascontiguousarray(values)
        kind = "SCALAR" if data.ndim == 1 else f"VEC{data.shape[1]}"
        code = {2: 5123, 4: 5125}[data.itemsize]
        self.accessors.append(
            {"bufferView": len(self.views), "componentType": code, "count": len(data), "type": kind}
        )
        self.attach(data.tobytes())
        return len(self.accessors) - 1

    def attach(self, data: bytes) -> int:
        """Add bytes as they are, e.g. a picture; gives the index of their view."""
        self.views.append({"buffer": 0, "byteOffset": self._length, "byteLength": len(data)})
        data += b"\0" * (-len(data) % 4)
        self._parts.append(data)
        self._length += len(data)
        return len(self.views) - 1

    def data(self) -> bytes:
        """All of it, in order."""
        return b"".join(self._parts)


def write(path: Path, document: dict[str, Any], numbers: Numbers) -> None:
    """Write a GLB; buffers, views and accessors are put into the document."""
    data = numbers.data()
    document = document | {
        "buffers": [{"byteLength": len(data)}], "bufferViews": numbers.views, "accessors": numbers.accessors
    }  # fmt: skip
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    length = _HEADER.size + 2 * _CHUNK.size + len(text) + len(data)
    with path.open("wb") as file:
        file.write(_HEADER.pack(b"glTF", 2, length))
        file.write(_CHUNK.pack(len(text), b"JSON") + text)
        file.write(_CHUNK.pack(len(data), b"BIN\0") + data)


class Glb:
    """A GLB that was read.

    Args:
        path: where from, for sentences.
        document: its JSON.
        data: its block of numbers.
    """

    def __init__(self, path: Path, document: dict[str, Any], data: bytes) -> None:
        self.path, self.document, self.data = path, document, data

    def numbers(self, index: int) -> Array:
        """The values of one accessor, (T,) or (T, n), float64.

        Raises:
            StudioError: it reaches outside the file or is kept in a way that motion never is.
            KeyError, IndexError, TypeError, ValueError: the document makes no sense there.
        """
        accessor = entry(self.document, "accessors", index)
        if "sparse" in accessor:
            raise self._unreadable()
        values = self._values(accessor)
        # A damaged file may hold NaNs that signal.
        with np.errstate(invalid="ignore"):
            floats = values.astype(np.float64)
        if accessor["componentType"] != FLOAT:
            floats = np.maximum(floats / np.iinfo(values.dtype).max, -1.0)
        if not np.isfinite(floats).all():
            raise damaged(self.path)
        width = floats.shape[1]
        return floats[:, 0] if width == 1 else floats

    def table(self, index: int, most: int) -> NDArray[Any]:
        """The values of one accessor as the file keeps them (T, n), of its own type, sparse ones filled in.

        Args:
            index: of the accessor.
            most: refuse more rows than these, which only an accessor without numbers of its own could claim.

        Raises: as `numbers`.
        """
        accessor = entry(self.document, "accessors", index)
        kind, width, count = _TYPES[accessor["componentType"]], _SIZES[accessor["type"]], accessor["count"]
        if "bufferView" in accessor:
            values = self._values(accessor)
        elif isinstance(count, int) and 0 < count <= most:
            values = np.zeros((count, width), kind)
        else:
            raise cut_short(self.path)
        if "sparse" in accessor:
            values = self._filled(values.copy(), accessor)
        if accessor["componentType"] == FLOAT and not np.isfinite(values).all():
            raise damaged(self.path)
        return values

    def block(self, index: int) -> bytes:
        """The bytes of one buffer view, e.g. a picture; the errors are those of `numbers`."""
        view = self._view(index)
        start, length = view.get("byteOffset", 0), view["byteLength"]
        whole = all(isinstance(value, int) and value >= 0 for value in (start, length))
        if not whole or start + length > len(self.data):
            raise cut_short(self.path)
        return self.data[start : start + length]

    def _view(self, index: Any) -> dict[str, Any]:
        view = entry(self.document, "bufferViews", index)
        if view.get("buffer", 0) != 0 or "uri" in self.document["buffers"][0]:
            raise self._unreadable()
        return view

    def _unreadable(self) -> StudioError:
        what = say("{name} stores its numbers in a way the studio cannot read.", name=self.path.name)
        return StudioError(what, "Save it as one GLB file without extra buffers.")

    def _values(self, accessor: dict[str, Any]) -> NDArray[Any]:
        """The rows of an accessor (T, n) where they lie in the file."""
        kind, width, count = _TYPES[accessor["componentType"]], _SIZES[accessor["type"]], accessor["count"]
        view = self._view(accessor["bufferView"])
        item = np.dtype(kind).itemsize * width
        stride = view.get("byteStride", item)
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        whole = all(isinstance(value, int) and value >= 0 for value in (count, stride, start))
        if not whole or count < 1 or stride < item or start + stride * (count - 1) + item > len(self.data):
            raise cut_short(self.path)
        return np.ndarray((count, width), kind, self.data, start, (stride, np.dtype(kind).itemsize))

    def _filled(self, values: NDArray[Any], accessor: dict[str, Any]) -> NDArray[Any]:
        """An accessor's rows with those that differ put in. Source: glTF 2.0, 3.6.2.3."""
        sparse = accessor["sparse"]
        places = sparse["indices"] | {"count": sparse["count"], "type": "SCALAR"}
        entries = accessor | sparse["values"] | {"count": sparse["count"]}
        entries["byteOffset"] = sparse["values"].get("byteOffset", 0)
        rows = self._values(places)[:, 0].astype(np.int64)
        values[rows] = self._values(entries)
        return values


def read(path: Path) -> Glb:
    """Read a GLB.

    Raises:
        StudioError: it is missing, no GLB, cut short or damaged.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise StudioError(
                say("{name} is larger than 1 GB.", name=path.name), "Split the motion into shorter files."
            )
        content = path.read_bytes()
    except OSError as error:
        raise StudioError(
            say("{name} cannot be read.", name=path.name),
            say("Check the file in {folder}.", folder=path.parent),
        ) from error
    if len(content) < _HEADER.size + _CHUNK.size or not content.startswith(b"glTF"):
        raise StudioError(say("{name} holds no avatar.", name=path.name), "Choose a .vrm or .glb file.")
    _, version, length = _HEADER.unpack_from(content)
    if version != 2:
        raise StudioError(
            say("{name} is glTF {version}; the studio reads glTF 2.", name=path.name, version=version), _AGAIN
        )
    size, kind = _CHUNK.unpack_from(content, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    if length > len(content) or start + size > len(content):
        raise cut_short(path)
    try:
        document = json.loads(content[start : start + size].decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise damaged(path) from error
    if kind != b"JSON" or not isinstance(document, dict):
        raise damaged(path)
    return Glb(path, document, _binary(path, content, start + size))


def _binary(path: Path, content: bytes, start: int) -> bytes:
    if start + _CHUNK.size > len(content):
        return b""
    size, kind = _CHUNK.unpack_from(content, start)
    begin = start + _CHUNK.size
    if begin + size > len(content):
        raise cut_short(path)
    return content[begin : begin + size] if kind == b"BIN\0" else b""


def entry(document: dict[str, Any], name: str, index: Any) -> dict[str, Any]:
    """One entry of a list in a document; IndexError or TypeError where there is none."""
    if isinstance(index, bool) or not isinstance(index, int) or index < 0:
        raise IndexError(index)
    found = document[name][index]
    if not isinstance(found, dict):
        raise TypeError(name)
    return found


def damaged(path: Path) -> StudioError:
    """What to say of a file that cannot be understood."""
    return StudioError(say("{name} is damaged.", name=path.name), _AGAIN)


def cut_short(path: Path) -> StudioError:
    """What to say of a file that ends too early."""
    return StudioError(say("{name} is cut short or damaged.", name=path.name), _AGAIN)
