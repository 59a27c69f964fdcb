"""A disk that is full at any moment of every command that writes: a small one in memory, Linux only.

Whatever fails must say so in a sentence, leave everything that was whole as it was, and end well once there
is room.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.torture import children, projects
from tests.torture.attempts import Moment
from tests.torture.cases import Outcome
from tests.torture.commands import judge
from tests.torture.kills import Kills, writer

_NEW_MOUNTS, _NEW_USER = 0x00020000, 0x10000000
_REMOUNT, _PRIVATE = 32, (1 << 18) | 16384
_ROOM = 1 << 30


class FullDisk(Kills):
    """Nothing whole is lost, the disk is named, and with room the command ends well."""

    NAME = "full-disk"
    SHARES = "kills"

    def prepare(self, numbers: Sequence[int]) -> str:
        """As for kills; and whether a small disk can be had."""
        if sys.platform != "linux":
            return "Small disks in memory are made on Linux alone."
        disk = self.shared / "disk"
        disk.mkdir(exist_ok=True)
        if children.apart(lambda: _own_disk(disk, _ROOM), self.shared / "console"):
            return "This system lets nobody make a disk in memory."
        return super().prepare(numbers)

    def case(self, number: int, place: Path) -> Outcome:
        """Run one command on a disk with less room than it needs, then with enough."""
        outcome, dice = Outcome(), self.random(number)
        name = writer(number)
        _, _, added = self.length(name)
        disk = place / "disk"
        disk.mkdir()
        _own_disk(disk, _ROOM)
        self.set_out(disk)
        used = os.statvfs(disk)
        taken = (used.f_blocks - used.f_bfree) * used.f_frsize
        room = dice.choice((0, 4096, round(added * dice.random()), round(1.2 * added * dice.random())))
        _resize(disk, taken + room)
        whole = projects.Whole.of(disk / projects.NAME)
        if dice.random() < 0.5:
            os.environ["TMPDIR"] = str(disk / "tmp")
        tried = self.attempt(name, disk, Moment(), beside=place)
        judge(tried.told, outcome)
        outcome.counts["ended in a sentence" if tried.told.code else "had room"] += 1
        moment = f"{name} with {room} bytes left"
        project, console = disk / projects.NAME, place / "console"
        children.judged_apart(lambda own: whole.check(project, own, moment), outcome, console)
        _resize(disk, _ROOM)
        told = judge(self.attempt(name, disk, Moment(), force=True, beside=place).told, outcome)
        if told.code and (name, told.code) != ("unpack", 2):
            outcome.fault("not again", f"{moment}, then with room: {told.sentence}")

        def look(own: Outcome) -> None:
            whole.check(project, own, f"{moment}, then with room")
            projects.load_takes(project, own, moment)
            if left := projects.leftovers(disk):
                own.fault("leftover", f"{moment}: {', '.join(left[:4])}")

        children.judged_apart(look, outcome, console)
        return outcome


def _own_disk(at: Path, size: int) -> int:
    """A disk in memory that this process alone sees, gone when it ends; 0 where that worked."""
    system = ctypes.CDLL(None, use_errno=True)
    if system.unshare(_NEW_MOUNTS) and system.unshare(_NEW_MOUNTS | _NEW_USER):
        return 1
    system.mount(b"none", b"/", None, _PRIVATE, None)  # else everybody would see it
    mounted: int = system.mount(b"tmpfs", os.fsencode(at), b"tmpfs", 0, f"size={size}".encode())
    return -mounted


def _resize(disk: Path, size: int) -> None:
    system = ctypes.CDLL(None, use_errno=True)
    if system.mount(b"none", os.fsencode(disk), None, _REMOUNT, f"size={size}".encode()):
        raise OSError(ctypes.get_errno(), "the small disk cannot be resized")
