"""Packed projects and runs as malice makes them: nothing outside, nothing that runs, no half a project."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.torture import projects, watch
from tests.torture.cases import Limits, Outcome, Trial
from tests.torture.commands import judge, saia
from tests.torture.damage import damaged, mutant

Entries = list[tuple[zipfile.ZipInfo, bytes]]
CODE = b"open('evil', 'w')\n"
RUNS = {".py", ".pyc", ".pyd", ".so", ".dll", ".pth", ".exe", ".bat", ".sh", ".cmd"}
"""Endings of what some program would run."""
NAMES = (
    "../evil", "../../evil.py", "takes/../../evil", "/evil", "//evil/share/x", "C:/evil", "C:evil",
    "\\\\host\\evil", "..\\evil", "takes\\..\\..\\evil", "con", "takes/aux.txt", "nul.json",
    "takes/Toy_001/../../../evil", "./evil", "takes//evil", " ", ".", "..", "a" * 300,
    "/".join("d" * 60 for _ in range(80)), "evil\0.json", "takes", "takes/Toy_001",
    "takes/Toy_001/take.json/x", "studio/__init__.py", "numpy.py", "sitecustomize.py", "usercustomize.py",
    "studio.py", "takes/evil.pth", "runs/quick_001/evil.so", ".git/hooks/post-checkout", "evil\n.json",
    "takes/e\u202evil", "PROJECT.JSON", "project.json/", "dataset.json", ".lock", ".cache/evil",
    ".trash/evil", "exports/evil.exe", "日本語/evil",
)  # fmt: skip

LIES = (
    (8, b"\x01\x00"),
    (10, b"\x63\x00"),
    (20, b"\xff\xff\xff\x7f"),
    (24, b"\x01\0\0\0"),
    (24, b"\0\0\0\x7f"),
)
"""Where in an entry of the table at the end, and what: a password, a way of packing, three sizes."""


class Zips(Trial):
    """What is unpacked lies in its folder, holds nothing that runs, and opens; or nothing is left of it."""

    NAME = "zips"
    LIMITS = Limits(cpu_s=20, wall_s=120.0)
    WARM = ("studio.take.check", "studio.inference.offline", "torch._dynamo")

    def prepare(self, numbers: Sequence[int]) -> str:
        """A packed project, a packed run, and a project to bring runs into."""
        project = projects.make(self.shared)
        saia("pack", project, "-o", self.shared / "a.zip")
        saia("pack", project, "--run", projects.RUN, "-o", self.shared / "a.saiarun")
        return ""

    def case(self, number: int, place: Path) -> Outcome:
        """Unpack one hostile zip."""
        outcome, dice = Outcome(), self.random(number)
        source = self.shared / ("a.zip", "a.saiarun")[number % 2]
        data, kinds = hostile(source, dice)
        outcome.counts.update(kinds)
        (place / "in").mkdir()
        path = place / "in" / source.name
        path.write_bytes(data)
        target = place / "T" / "P"
        if source.suffix == ".saiarun":
            projects.copied(self.shared / projects.NAME, place)
            target = place / projects.NAME
        before = projects.contents(place)
        watch.outside((place,), outcome.fault)
        told = judge(saia("unpack", path, target), outcome)
        self._look(told.code, place, target, before, outcome)
        if "could not be written" in told.sentence:
            outcome.fault("blames the target", told.sentence)
        if told.code == 0:
            outcome.counts["unpacked"] += 1
            judge(saia("check", target), outcome)
        for at, (kind, sentence) in enumerate(outcome.faults):
            outcome.faults[at] = (kind, f"{source.name} ({', '.join(kinds)}): {sentence}")
        return outcome

    def _look(self, code: int, place: Path, target: Path, before: dict[str, str], outcome: Outcome) -> None:
        now = projects.contents(place)
        within = target.relative_to(place).as_posix() + "/"
        new = [
            name for name in now if name not in before and not name.startswith(("home/", "tmp/", "console"))
        ]
        if out := [name for name in new if not name.startswith(within)]:
            outcome.fault("outside", f"{', '.join(out[:3])} appeared.")
        if bad := [name for name in new if Path(name).suffix.lower() in RUNS]:
            outcome.fault("foreign code", f"{', '.join(bad[:3])} was unpacked.")
        if links := [path.name for path in place.rglob("*") if path.is_symlink()]:
            outcome.fault("link", f"{links[0]} is a symbolic link.")
        if changed := [
            name
            for name, digest in before.items()
            if now.get(name) != digest and not name.startswith("console")
        ]:
            outcome.fault("lost", f"{', '.join(changed[:3])} changed or went.")
        if code and (left := [name for name in new if not name.endswith("/.lock")]):
            outcome.fault("leftover", f"It was refused, and {', '.join(left[:3])} is there.")
        if left := projects.leftovers(place):
            outcome.fault("leftover", ", ".join(left[:3]))


def hostile(source: Path, dice: random.Random) -> tuple[bytes, list[str]]:
    """The zip with something wrong in it, and the names of what is."""
    with zipfile.ZipFile(source) as file:
        entries = [(info, file.read(info)) for info in file.infolist()]
    kinds = []
    for _ in range(dice.choice((1, 1, 2, 3))):
        kind = dice.choice(tuple(CHANGES))
        CHANGES[kind](entries, dice)
        kinds.append(kind)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
        for info, content in entries:
            _written(file, info, content)
    data = packed.getvalue()
    if dice.random() < 0.12:
        done = damaged(data, dice)
        data, kinds = done.data, [*kinds, f"bytes {done.kind}"]
    if dice.random() < 0.15:
        data, kinds = _lying(data, dice), [*kinds, "lying head"]
    return data, kinds


def _written(file: zipfile.ZipFile, info: zipfile.ZipInfo, content: bytes) -> None:
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a name comes twice is the point
        fresh = zipfile.ZipInfo("x")
        fresh.filename, fresh.external_attr = info.filename, info.external_attr
        fresh.compress_type = zipfile.ZIP_DEFLATED
        file.writestr(fresh, content)


def _add(entries: Entries, dice: random.Random) -> None:
    entries.insert(dice.randrange(len(entries) + 1), (_info(dice.choice(NAMES)), CODE))


def _code(entries: Entries, dice: random.Random) -> None:
    entries.append((_info(dice.choice([name for name in NAMES if Path(name).suffix in RUNS])), CODE))


def _rename(entries: Entries, dice: random.Random) -> None:
    at = dice.randrange(len(entries))
    entries[at] = (_info(dice.choice(NAMES)), entries[at][1])


def _twice(entries: Entries, dice: random.Random) -> None:
    info, content = dice.choice(entries)
    entries.append((_info(info.filename), mutant(content, dice)[1] if content else b"x"))


def _other_case(entries: Entries, dice: random.Random) -> None:
    info, content = dice.choice(entries)
    entries.append((_info(info.filename.swapcase()), content))


def _link(entries: Entries, dice: random.Random) -> None:
    info = _info(dice.choice(("takes/link", "runs", "exports/link", "link")))
    info.external_attr = 0o120777 << 16
    entries.insert(0, (info, dice.choice((b"/etc/passwd", b"..", b"../../evil"))))
    entries.append((_info(f"{info.filename}/evil.txt"), b"through the link"))


def _mutated(entries: Entries, dice: random.Random) -> None:
    at = dice.randrange(len(entries))
    entries[at] = (entries[at][0], mutant(entries[at][1] or b"{}", dice)[1])


def _deep(entries: Entries, dice: random.Random) -> None:
    at = dice.randrange(len(entries))
    deep = b"[" * 100_000 + b"]" * 100_000
    entries[at] = (
        entries[at][0],
        dice.choice((deep, b'{"version": ' + b"9" * 5000 + b"}", b"\xff\xfe" * 50)),
    )


def _big(entries: Entries, dice: random.Random) -> None:
    entries.append(
        (_info(dice.choice(("takes/Big/audio.wav", "exports/big.bin", "note.txt"))), bytes(32 << 20))
    )


def _many(entries: Entries, dice: random.Random) -> None:
    entries.extend((_info(f"exports/{k:05d}.txt"), b"") for k in range(dice.choice((300, 3000))))


def _gone(entries: Entries, dice: random.Random) -> None:
    del entries[dice.randrange(len(entries))]


def _newer(entries: Entries, dice: random.Random) -> None:
    entries[:] = [
        (i, json.dumps({"version": 99}).encode() if i.filename.endswith(".json") else c) for i, c in entries
    ]


CHANGES: dict[str, Callable[[Entries, random.Random], None]] = {
    "added": _add, "code": _code, "renamed": _rename, "twice": _twice, "other case": _other_case,
    "link": _link, "mutated": _mutated, "deep": _deep, "big": _big, "many": _many,
    "gone": _gone, "newer": _newer,
}  # fmt: skip


def _info(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo("x")
    info.filename = name  # as it is: the class itself would put right what is wrong with it
    return info


def _lying(data: bytes, dice: random.Random) -> bytes:
    """The table at the end says something else of an entry: its size, its way of packing, that it has a
    password."""
    at = data.find(b"PK\x01\x02", dice.randrange(len(data)))
    if at < 0:
        return data
    start, new = dice.choice(LIES)
    return data[: at + start] + new + data[at + start + len(new) :]
