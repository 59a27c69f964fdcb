"""VMD, MikuMikuDance's motion: face morphs, and the upper body of models with the usual Japanese names."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, counted, say
from studio.formats import Imported
from studio.formats._table import check_suffix
from studio.formats._writing import checked, grounded_body, on_grid
from studio.formats.saia_csv import find_audio
from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import VRM1_TO_VRM0
from studio.motion.sanitize import credible

Array = NDArray[np.floating]

# An MMD unit is about 8 cm: a model of 20 units is 1.6 m tall.
METRES_A_UNIT = 0.08
ARM_REST = np.radians(35.0)
"""How far below level an MMD model's arms rest; most stand between 30 and 40 degrees."""
CENTRE = "センター"
_BODY = {
    "下半身": "Hips", "上半身": "Spine", "上半身2": "UpperChest", "首": "Neck", "頭": "Head",
    "左目": "LeftEye", "右目": "RightEye",
}  # fmt: skip
_ARMS = {"肩": "Shoulder", "腕": "UpperArm", "ひじ": "LowerArm", "手首": "Hand"}
_FINGERS = {"人指": "Index", "中指": "Middle", "薬指": "Ring", "小指": "Little"}
_PARTS = ("Proximal", "Intermediate", "Distal")


def _names() -> dict[str, str]:
    found = dict(_BODY)
    for kanji, side in (("左", "Left"), ("右", "Right")):
        found |= {kanji + name: side + bone for name, bone in _ARMS.items()}
        for i, part in enumerate(_PARTS):
            found |= {f"{kanji}{name}{'１２３'[i]}": side + f + part for name, f in _FINGERS.items()}
            found[f"{kanji}親指{'０１２'[i]}"] = f"{side}Thumb{part}"
    return found


BONES = _names()
"""HumanBodyBones name by MMD's."""
NAMES = frozenset((*BONES, CENTRE, "グルーブ"))
KEPT = frozenset(BONES.values())
# MMD's figures face -Z: half a turn about Y between Unity's axes and its own.
_HALF_TURN = np.array([-1.0, 1.0, -1.0])
_HALF_TURN_Q = np.array([-1.0, 1.0, -1.0, 1.0])


def _rests_lower(bone: str) -> float:
    """The side (+1 left, -1 right) of a bone that hangs from a lowered arm, 0 for others."""
    side = 1.0 if bone.startswith("Left") else -1.0 if bone.startswith("Right") else 0.0
    return 0.0 if bone.endswith(("Eye", "Shoulder")) else side


def _lowered(bone: str) -> Array:
    """The turn that takes a bone from the T-pose to MMD's rest, in MMD's axes (the left arm along +X)."""
    return rotation.from_axis_angle([0.0, 0.0, 1.0], -_rests_lower(bone) * ARM_REST)


def from_humanoid(body: Motion) -> dict[str, tuple[Array, Array]]:
    """Positions (T, 3) in MMD's units and rotations (T, 4) by MMD's bone name.

    Args:
        body: humanoid bones, hips among them.

    Returns:
        The bones the body has. Each turn is D_parent^-1 D, with D the bone's change from MMD's own rest.
    """
    names = body.bone_names
    _, turned = body.skeleton.forward(body.positions, body.rotations)
    world = {name: turned[:, j] * _HALF_TURN_Q for j, name in enumerate(names)}
    still = np.zeros((len(body), 3))
    hips = body.positions[:, names.index("Hips")]
    moved = (hips - Skeleton.humanoid(("Hips",)).rest_positions[0] * _height(body)) * _HALF_TURN
    found: dict[str, tuple[Array, Array]] = {
        CENTRE: (moved / METRES_A_UNIT, np.tile(rotation.IDENTITY, (len(body), 1)))
    }
    present = {bone for bone in BONES.values() if bone in world}
    for name, bone in BONES.items():
        if bone not in present:
            continue
        # The change from MMD's own rest, whose arms hang lower than a T-pose's.
        change = rotation.multiply(world[bone], rotation.inverse(_lowered(bone)))
        above = _above(bone, present)
        if above:
            up = rotation.multiply(world[above], rotation.inverse(_lowered(above)))
            change = rotation.multiply(rotation.inverse(up), change)
        found[name] = (still, rotation.sign_continuous(change))
    return found


def to_humanoid(tracks: dict[str, tuple[Array, Array]], frames: int) -> tuple[tuple[str, ...], Array, Array]:
    """Bone names, local positions (T, J, 3) and local rotations (T, J, 4) in Unity's axes.

    Args:
        tracks: positions (T, 3) and rotations (T, 4) by MMD's bone name, of NAMES only.
        frames: T.
    """
    present = {BONES[name] for name in tracks if name in BONES}
    if not tracks:
        return (), np.zeros((frames, 0, 3)), np.zeros((frames, 0, 4))
    names = tuple(dict.fromkeys(("Hips", *(bone for bone in BONES.values() if bone in present))))
    whole = np.tile(rotation.IDENTITY, (frames, 1))
    changes: dict[str, Array] = {}
    # In the table's order, where parents come before their children.
    for name, bone in BONES.items():
        if bone in present:
            above = _above(bone, present)
            changes[bone] = rotation.multiply(changes[above] if above else whole, tracks[name][1])
    world = {b: rotation.multiply(c, _lowered(b)) * _HALF_TURN_Q for b, c in changes.items()}
    rest = Skeleton.humanoid(names)
    positions = np.tile(rest.rest_positions, (frames, 1, 1))
    for name in (CENTRE, "グルーブ"):
        if name in tracks:
            positions[:, 0] += tracks[name][0] * _HALF_TURN * METRES_A_UNIT
    rotations = np.tile(rotation.IDENTITY, (frames, len(names), 1))
    for j, bone in enumerate(names):
        parent = names[rest.parents[j]] if rest.parents[j] >= 0 else ""
        q = world.get(bone, whole)
        rotations[:, j] = rotation.multiply(rotation.inverse(world.get(parent, whole)), q) if parent else q
    return names, positions, rotations


def _above(bone: str, present: set[str]) -> str:
    """The bone that one hangs from in MMD, "" for the centre."""
    if bone in ("Hips", "Spine"):
        return ""
    rest = Skeleton.humanoid(tuple(sorted(present)))
    parent = rest.parents[rest.bone_names.index(bone)]
    above = rest.bone_names[parent] if parent >= 0 else ""
    return "" if above == "Hips" else above


def _height(body: Motion) -> float:
    """The body's resting hips height against the built-in figure's."""
    hips = body.bone_names.index("Hips")
    return float(np.median(body.positions[:, hips, 1])) / float(
        Skeleton.humanoid(("Hips",)).rest_positions[0, 1]
    )


TITLE = "MikuMikuDance motion"
SUFFIX = ".vmd"
FPS = 30.0
BONES_KEPT = KEPT
NOTE = (
    "30 frames a second: mouth, blinks and moods as morphs; head, eyes, arms, fingers and body by the usual "
    "Japanese bone names, arms taken to rest 35° below level. The legs are left to MMD's IK; no sound."
)

MORPHS = {
    "A": "あ", "I": "い", "U": "う", "E": "え", "O": "お", "Blink": "まばたき", "Blink_L": "ウィンク",
    "Blink_R": "ウィンク右", "Joy": "笑い", "Fun": "にこり", "Angry": "怒り", "Sorrow": "困る",
    "Surprised": "びっくり",
}  # fmt: skip
_ALSO = {"ウィンク２": "Blink_L", "ｳｨﾝｸ２右": "Blink_R"}
_FROM_MORPH = {morph: shape for shape, morph in MORPHS.items()} | _ALSO
_LEFT_OUT = frozenset(("neutral", "lookup", "lookdown", "lookleft", "lookright"))

_MAGIC = b"Vocaloid Motion Data 0002"
_BONE = np.dtype([("name", "S15"), ("frame", "<u4"), ("at", "<f4", 3), ("turn", "<f4", 4), ("way", "u1", 64)])
_MORPH = np.dtype([("name", "S15"), ("frame", "<u4"), ("weight", "<f4")])
# Longer than any dance; a number beyond that is damage.
_LAST_FRAME = int(6 * 3600 * FPS)
# A small file may claim to last for hours with thousands of names. Each cell, which is one bone on one frame,
# takes some 300 bytes while it is read, and as much as eight morphs do.
_MOST_CELLS, _MOST_CELLS_A_KEY = 2_500_000, 10
_MORPHS_A_BONE = 8
_STILL = 1e-6
# MMD's curve for a straight line, as its editor writes it: four handles at 20 and 107 of 127.
_STRAIGHT = np.tile(np.repeat(np.array([20, 107], dtype=np.uint8), 8), 4)
_AGAIN = "Export it again from the program it came from."


def read(path: Path, audio: Path | None = None) -> Imported:
    """Read morphs and the bones whose names are known, and the sound of the same name beside it.

    Raises:
        StudioError: it is no VMD, cut short, holds no motion, or claims more than six hours.
    """
    notes: list[str] = []
    bones, morphs = _nearby(*_read(path), path, notes)
    frames = max(int(part["frame"].max(initial=0)) for part in (bones, morphs))
    _check_size(path, bones, morphs, frames)
    times = np.arange(frames + 1) / FPS
    tracks = {_name(raw): part for raw, part in _by_name(bones)}
    known = {name: _bone_track(part, frames) for name, part in tracks.items() if name in NAMES}
    # IK targets and hair physics are most of a file's bones, and MMD makes them itself.
    if len(tracks) > len(known):
        other = next(name for name in tracks if name not in known)
        notes.append(
            say(
                "{name}: {bones} left out, such as {other}.",
                name=path.name,
                bones=counted(len(tracks) - len(known), "bone"),
                other=other,
            )
        )
    weights = {_shape(_name(raw)): _morph_track(part, frames) for raw, part in _by_name(morphs)}
    if not known and not weights:
        raise StudioError(
            say("{name} contains no face shapes or bones that the studio knows.", name=path.name), _AGAIN
        )
    names, positions, rotations = to_humanoid(known, frames + 1)
    if names:
        notes.append("Arms were taken to rest 35° below level, and moves between keys as straight.")
    motion = Motion.build(
        times, tuple(weights), np.stack(list(weights.values()), axis=1) if weights else None, names,
        positions, rotations,
    )  # fmt: skip
    audio = audio or find_audio(path)
    notes += [] if audio else [say("No sound was found for {name}.", name=path.stem)]
    return Imported(path.stem, motion, audio, tuple(notes))


def _nearby(
    bones: NDArray[Any], morphs: NDArray[Any], path: Path, notes: list[str]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The keys without a few far behind all others: one wrong number would make hours of a dance."""
    at = np.unique(np.concatenate([bones["frame"], morphs["frame"]]))
    last = int(at[credible(at / FPS)[-1]])
    near = tuple(part[part["frame"] <= last] for part in (bones, morphs))
    gone = len(bones) + len(morphs) - sum(map(len, near))
    if gone:
        notes.append(
            say(
                "{name}: {keys} left out, at {at} s, far behind all others.",
                name=path.name,
                keys=counted(gone, "key"),
                at=f"{at[-1] / FPS:.0f}",
            )
        )
    return near[0], near[1]


def _check_size(path: Path, bones: NDArray[Any], morphs: NDArray[Any], frames: int) -> None:
    """StudioError where the keys are to fill more than a file of this size has to say."""
    if frames > _LAST_FRAME:
        raise StudioError(
            say("{name} claims to last {seconds} s.", name=path.name, seconds=f"{frames / FPS:.0f}"),
            "It is damaged; export it again.",
        )
    faces, turned = len(np.unique(morphs["name"])), {_name(bytes(raw)) for raw in np.unique(bones["name"])}
    cells = (frames + 1) * (len(turned & NAMES) + faces / _MORPHS_A_BONE)
    if cells > _MOST_CELLS + _MOST_CELLS_A_KEY * (len(bones) + len(morphs)):
        what = say(
            "{name} claims {n} tracks of {seconds} s.",
            name=path.name,
            n=len(turned) + faces,
            seconds=f"{frames / FPS:.0f}",
        )
        raise StudioError(what, "Split it into shorter files.")


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write morphs and bones at 30 frames a second from the sound's first moment on.

    Args:
        path: ends in .vmd.
        motion: with shapes, bones or both.
        audio: not written; a VMD has no sound.

    Returns:
        The file, read back and compared.
    """
    check_suffix(path, SUFFIX)
    if not len(motion) or not (motion.bone_names or motion.shape_names):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    even = on_grid(motion, FPS)
    morphs = _morphs(even)
    body = grounded_body(even)
    bones = from_humanoid(body) if body is not None else {}
    if not morphs and not bones:
        raise RequestError(
            say("Nothing in the motion fits into {name}.", name=path.name),
            "Export it as VRM Animation instead.",
        )
    bone_rows = _rows(_BONE, [_bone_rows(name, at, turn) for name, (at, turn) in bones.items()])
    morph_rows = _rows(_MORPH, [_morph_rows(name, weights) for name, weights in morphs.items()])
    model = path.stem.encode("cp932", "ignore")[:19].ljust(20, b"\0")

    def put(beside: Path) -> None:
        with beside.open("wb") as file:
            file.write(_MAGIC.ljust(30, b"\0") + model)
            for part in (bone_rows, morph_rows):
                file.write(struct.pack("<I", len(part)) + part.tobytes())
            # No keys of camera, light and shadow; MMD refuses a file without these counts.
            file.write(struct.pack("<3I", 0, 0, 0))

    return checked(path, put, lambda beside: _fits(beside, morphs, bones, len(even)))


def _morphs(motion: Motion) -> dict[str, Array]:
    """Weights (T,) by morph; what has no Japanese name keeps its own where that fits."""
    canon = {shape.lower(): shape for shape in MORPHS} | {a.lower(): b for a, b in VRM1_TO_VRM0.items()}
    found: dict[str, Array] = {}
    for s, shape in enumerate(motion.shape_names):
        known = canon.get(shape.lower(), shape)
        name = MORPHS.get(known, known)
        fits = 0 < len(_encoded(name)) <= 15 and _name(_encoded(name)) == name
        if fits and known.lower() not in _LEFT_OUT and name not in found:
            found[name] = motion.shapes[:, s]
    return found


def _keys(*values: Array) -> NDArray[np.intp]:
    """Frames that say something: the first, the last, and those beside a change."""
    flat = np.concatenate([v.reshape(len(v), -1) for v in values], axis=1)
    moved = np.abs(np.diff(flat, axis=0)).max(axis=1, initial=0.0) > _STILL
    keep = np.concatenate([[True], moved]) | np.concatenate([moved, [True]])
    return np.flatnonzero(keep)


def _bone_rows(name: str, at: Array, turn: Array) -> NDArray[Any]:
    frames = _keys(at, turn)
    rows = np.zeros(len(frames), _BONE)
    # Straight lines between keys, since every change has a key of its own.
    rows["name"], rows["frame"], rows["way"] = _encoded(name), frames, _STRAIGHT
    rows["at"], rows["turn"] = at[frames], turn[frames]
    return rows


def _morph_rows(name: str, weights: Array) -> NDArray[Any]:
    frames = _keys(weights)
    rows = np.zeros(len(frames), _MORPH)
    rows["name"], rows["frame"], rows["weight"] = _encoded(name), frames, weights[frames]
    return rows


def _rows(kind: np.dtype[Any], parts: list[NDArray[Any]]) -> NDArray[Any]:
    return np.concatenate([np.zeros(0, kind), *parts])


def _read(path: Path) -> tuple[NDArray[Any], NDArray[Any]]:
    """The keys of bones and of morphs, as they stand in the file."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise StudioError(
            say("{name} cannot be read.", name=path.name),
            say("Check the file in {folder}.", folder=path.parent),
        ) from error
    if not data.startswith(_MAGIC):
        what = say("{name} is not a MikuMikuDance motion.", name=path.name)
        raise StudioError(what, "Choose a VMD file saved by MikuMikuDance 3 or later.")
    start, parts = 50, []
    for kind in (_BONE, _MORPH):
        count = struct.unpack_from("<I", data, start)[0] if len(data) >= start + 4 else None
        if count is None or start + 4 + count * kind.itemsize > len(data):
            raise StudioError(say("{name} is cut short or damaged.", name=path.name), _AGAIN)
        parts.append(np.frombuffer(data, kind, count, start + 4))
        start += 4 + count * kind.itemsize
    bones, morphs = parts
    if not len(bones) and not len(morphs):
        raise StudioError(
            say("{name} holds no motion.", name=path.name), "Choose a VMD file with a face or a body."
        )
    numbers = (bones["at"], bones["turn"], morphs["weight"])
    if not all(np.isfinite(values).all() for values in numbers) or np.abs(bones["at"]).max(initial=0) > 1e6:
        raise StudioError(say("{name} is damaged.", name=path.name), _AGAIN)
    return bones, morphs


def _by_name(rows: NDArray[Any]) -> Iterator[tuple[bytes, NDArray[Any]]]:
    """The keys of each name, in order of their frames, the last of each frame alone."""
    if not len(rows):
        return
    names, first, which = np.unique(rows["name"], return_index=True, return_inverse=True)
    ends = np.cumsum(np.bincount(which))
    grouped = np.lexsort((rows["frame"], which))
    for i in np.argsort(first):
        part = rows[grouped[ends[i - 1] if i else 0 : ends[i]]]
        last = np.append(np.diff(part["frame"].astype(np.int64)) > 0, True)
        yield bytes(names[i]), part[last]


def _bone_track(part: NDArray[Any], frames: int) -> tuple[Array, Array]:
    """Positions (T, 3) and rotations (T, 4) on every frame."""
    keys, at = part["frame"].astype(np.float64), part["at"].astype(np.float64)
    turn = rotation.normalised(part["turn"])
    t = np.arange(frames + 1, dtype=np.float64)
    right = np.clip(np.searchsorted(keys, t), 0, len(keys) - 1)
    left = np.clip(np.searchsorted(keys, t, side="right") - 1, 0, len(keys) - 1)
    span = np.where(right > left, keys[right] - keys[left], 1.0)
    amount = np.clip((t - keys[left]) / span, 0.0, 1.0)
    return at[left] + (at[right] - at[left]) * amount[:, None], rotation.slerp(
        turn[left], turn[right], amount
    )


def _morph_track(part: NDArray[Any], frames: int) -> Array:
    t = np.arange(frames + 1, dtype=np.float64)
    return np.clip(np.interp(t, part["frame"].astype(np.float64), part["weight"]), 0.0, 1.0)


def _name(raw: bytes) -> str:
    # Long names are cut at 15 bytes, which may be within a letter.
    return raw.split(b"\0")[0].decode("cp932", errors="ignore")


def _encoded(name: str) -> bytes:
    return name.encode("cp932", errors="ignore")


def _shape(morph: str) -> str:
    return _FROM_MORPH.get(morph, morph)


def _fits(path: Path, morphs: dict[str, Array], bones: dict[str, tuple[Array, Array]], frames: int) -> bool:
    """Whether a file holds what was to be written: every morph and every bone on every frame."""
    got_bones, got_morphs = _read(path)
    faces = {_name(raw): _morph_track(part, frames - 1) for raw, part in _by_name(got_morphs)}
    bodies = {_name(raw): _bone_track(part, frames - 1) for raw, part in _by_name(got_bones)}
    if set(faces) != set(morphs) or set(bodies) != set(bones):
        return False
    apart = [float(np.abs(faces[name] - np.clip(w, 0, 1)).max()) for name, w in morphs.items()]
    for name, (at, turn) in bones.items():
        moved, turned = bodies[name]
        angle = rotation.angle_between(turned, turn).max(initial=0.0)
        apart += [float(np.abs(moved - at).max()) / 10, float(angle)]
    # Not `any(far > ...)`: NaN compares as false, and must not pass.
    return all(far <= 1e-3 for far in apart)
