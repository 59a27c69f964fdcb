"""The VMC targets of a live performance: started, stopped and reported by name while it runs."""

from __future__ import annotations

import json

from studio.cli._output import address
from studio.errors import RequestError, StudioError, say
from studio.ipc.events import LiveTarget
from studio.vmc.encode import NAME_SETS, SendOptions
from studio.vmc.sender import Destination, PoseSource, TargetStatus, VmcTarget


class Targets:
    """All targets of a performance.

    Args:
        source: what to send.
        usual: how it is sent where a request does not say.
    """

    def __init__(self, source: PoseSource, usual: Destination) -> None:
        self._source, self._usual = source, usual
        self._targets: dict[str, VmcTarget] = {}
        self._statuses: dict[str, TargetStatus] = {}

    def send(self, command: str) -> None:
        """Begin to send to "HOST:PORT", or as JSON says; again, where it is sent to already.

        Raises:
            StudioError: the address or an option is not possible.
        """
        name, destination = self._read(command)
        # The same target is started again: two would send to one avatar in turns.
        target = self._targets.get(name) or VmcTarget()
        target.start(destination, self._source)
        self._targets[name] = target

    def unsend(self, name: str) -> None:
        """Fade that avatar to rest and send it nothing more."""
        target = self._targets.pop(name, None)
        self._statuses.pop(name, None)
        if target is not None:
            # The fade takes a while, and the performance must not stand still meanwhile.
            target.stop(wait=False)

    def wave(self, name: str) -> None:
        """Send the test wave there once."""
        target = self._targets.get(name)
        if target is not None:
            target.wave()

    def states(self) -> tuple[LiveTarget, ...]:
        """The state of each, for a display."""
        return tuple(
            LiveTarget(
                name, str(state.status), state.sent, state.dropped,
                state.problem.what if state.problem else "",
                state.problem.remedy if state.problem else "",
            )
            for name, state in ((name, target.state) for name, target in self._targets.items())
        )  # fmt: skip

    def changes(self) -> list[StudioError]:
        """Who is lost and who is back since the last call, as sentences."""
        said = []
        for name, target in self._targets.items():
            state, before = target.state, self._statuses.get(name, TargetStatus.SENDING)
            well = state.status is TargetStatus.SENDING
            if well and before in (TargetStatus.REFUSED, TargetStatus.ERROR):
                said.append(StudioError(say("{name} hears again.", name=name), "Nothing to do."))
            elif not well and before is TargetStatus.SENDING and state.problem is not None:
                said.append(state.problem)
            # A target that has not sent yet has no status that could be lost.
            if state.sent or not well:
                self._statuses[name] = state.status
        return said

    def stop(self) -> None:
        """Fade all avatars to rest."""
        for target in self._targets.values():
            target.stop(wait=False)
        for target in self._targets.values():
            target.stop()

    def _read(self, command: str) -> tuple[str, Destination]:
        if not command.startswith("{"):
            host, port = address(command)
            return command, Destination(host, port, self._usual.fps, self._usual.options)
        try:
            facts = json.loads(command)
            name = str(facts["to"])
            host, port = address(name)
            options = SendOptions(
                names=str(facts.get("names", "vrm0")),
                bundle=bool(facts.get("bundle", True)),
                rotations_only=bool(facts.get("rotations_only", False)),
            )
            fps = float(facts.get("fps", 60.0))
        # Whatever a line holds, the performance goes on.
        except (ValueError, KeyError, TypeError) as error:
            raise RequestError("That target was not understood.", "Write HOST:PORT.") from error
        if options.names not in NAME_SETS or not 1.0 <= fps <= 240.0:
            raise RequestError("That way of sending is not possible.", "Choose names and 1 to 240 frames/s.")
        return name, Destination(host, port, fps, options)
