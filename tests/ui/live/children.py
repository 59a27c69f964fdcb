"""What a child that performs says, for tests that need none."""

from __future__ import annotations

from studio.ui.live.presenter import LivePresenter
from studio.ui.live.view import LiveView
from studio.ui.session import Session

Room = tuple[LiveView, LivePresenter, Session]
Event = dict[str, object]


def ready(shapes: tuple[str, ...], bones: tuple[str, ...], source: str = "Mic") -> Event:
    """It is ready, with these channels."""
    channels = {"shape_names": shapes, "bone_names": bones, "positions": [[0.0, 1.0, 0.0]] * len(bones)}
    about = {"source": source, "look_aheads": [100], "look_ahead_ms": 100, "reach_ms": 92.0}
    return {"event": "ready", **about, **channels}


def pose(shapes: int, bones: int) -> Event:
    """A pose of so many channels, its shapes half open."""
    rest, turn = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    held: Event = {"rotations": [turn] * bones, "positions": [rest][:bones]}
    held |= {"root_position": rest, "root_rotation": turn}
    return {"event": "pose", "shapes": [0.5] * shapes, "peak_dbfs": -20.0, "rms_dbfs": -30.0, **held}


def state(**how: object) -> Event:
    """How it stands: all switches of the moment off, gain and idling on, but for what is said."""
    names = ("speaking", "muted", "frozen", "neutral", "clipped", "lost")
    numbers = {"gain_db": 0.0, "latency_ms": 100.0, "sound_delay_ms": 100, "idling": 0.0, "load": 0.1}
    usual = {"seen": "seen", "gain_on": True, "idles": True}
    return {"event": "state", **dict.fromkeys(names, False), **numbers, **usual, **how}
