"""Who is one sender: an address, or a host whose programs open a new socket for every packet. Pure."""

from __future__ import annotations

from collections import deque

ANY = "*"
"""Stands for the source port of a sender that has ever new ones."""
_NEW_AT_ONCE = 4
_WITHIN_S = 1.0
_STEADY_S = 1.0
_REMEMBERED = 64


class Addresses:
    """Tells a sender with ever new source ports from several programs of one host.

    Asked about addresses that are not known yet only, so a usual sender costs nothing.
    """

    def __init__(self) -> None:
        self._new: dict[tuple[str, int], deque[float]] = {}
        self._first: dict[tuple[str, int], float] = {}

    def name(self, sender: str, port: int, arrival: float) -> str:
        """Under which name a datagram's sender goes.

        Args:
            sender: "host:source port", not known so far. port: where it came in. arrival: when, seconds.

        Returns:
            The sender, or "host:*" where its host uses new source ports all the time.
        """
        host = sender.rpartition(":")[0]
        seen = self._first.get((sender, port))
        if seen is not None:
            self._first[sender, port] = self._first.pop((sender, port))  # the latest last
            if arrival - seen >= _STEADY_S:  # it keeps this port after all
                return sender
            return f"{host}:{ANY}" if self._churns(host, port) else sender
        if len(self._first) >= _REMEMBERED:
            del self._first[next(iter(self._first))]
        self._first[sender, port] = arrival
        if len(self._new) >= _REMEMBERED:
            self._new.clear()
        new = self._new.setdefault((host, port), deque(maxlen=_NEW_AT_ONCE))
        new.append(arrival)
        return f"{host}:{ANY}" if self._churns(host, port) else sender

    def _churns(self, host: str, port: int) -> bool:
        new = self._new.get((host, port))
        return new is not None and len(new) == _NEW_AT_ONCE and new[-1] - new[0] <= _WITHIN_S
