"""Whether a process lives: whoever's it is, and whatever number somebody wrote."""

import os
import subprocess
import sys

from studio.files import lock


def test_a_process_lives_until_it_has_ended() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        assert lock.is_alive(child.pid)
        child.communicate(b"\n")
    assert not lock.is_alive(child.pid)
    assert lock.is_alive(os.getppid())


def test_a_number_no_process_can_have_is_nobodys() -> None:
    assert not lock.is_alive(4_194_305)
    assert not lock.is_alive(10**30)
    assert not lock.is_alive(-1)
