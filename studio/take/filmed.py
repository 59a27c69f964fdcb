"""What a take's pictures were like, as findings: the face in them, and a phone that saw it too."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

from studio.errors import say, together
from studio.motion.filmed import BESIDE, HIDDEN, Agreement
from studio.take.take import Finding, TakeInfo

_FILMED: tuple[tuple[str, float, float, str, str], ...] = (
    (
        "face_turned",
        0.1,
        0.4,
        say("The head is turned too far from the camera"),
        "Look towards the camera.",
    ),
    (
        "face_blurred",
        0.2,
        0.6,
        say("The picture is blurred"),
        "Add light, hold the camera still or clean its lens.",
    ),
    (
        "mouth_hidden",
        0.02,
        0.4,
        say("The mouth is hidden"),
        "Keep hands and the microphone away from your lips.",
    ),
    ("face_dark", 0.2, 0.6, say("The face is too dark"), "Turn a lamp towards the face."),
    (
        "face_small",
        0.2,
        0.6,
        say("The face is too small"),
        "Come closer to the camera, or film with more pixels.",
    ),
)
"""What is said from which share of the frames on, as a minor and as a major fault."""
_CLOSELY, _ROUGHLY = 0.8, 0.5
"""Mean correlations from which on a webcam follows another tracker closely, and roughly."""


def filmed_findings(info: TakeInfo) -> Iterator[Finding]:
    """What the pictures say that the motion was tracked in."""
    shares = {name: _share(info.extra.get(name, "")) for name in ("face_seen", *(one[0] for one in _FILMED))}
    seen = shares["face_seen"]
    if seen is not None and seen < 0.995:
        what = say("A face was seen in {share} of the pictures.", share=f"{min(seen, 0.99):.0%}")
        severity = "major" if seen < 0.5 else "minor" if seen < 0.9 else "note"
        yield Finding(
            "face_lost", severity, what, "The other parts are left out; look whether all of them should be."
        )
    for name, minor, major, fault, remedy in _FILMED:
        share = shares[name]
        if share is not None and share >= minor:
            severity = "major" if share >= major else "minor"
            at, until = _longest(info, HIDDEN) if name == "mouth_hidden" else (None, None)
            yield Finding(
                name,
                severity,
                say("{fault} in {share} of the frames.", fault=fault, share=f"{share:.0%}"),
                remedy,
                at,
                until,
            )


def beside_findings(info: TakeInfo) -> Iterator[Finding]:
    """How well a webcam agrees with a phone, or another tracker, that saw the same face at once."""
    found = _agreement(info.extra.get(BESIDE, ""))
    if found is None:
        return
    known = [r for r in (found.jaw, found.mouth, found.blinks) if r is not None]
    if not known:
        return
    mean = sum(known) / len(known)
    named = ((say("jaw"), found.jaw), (say("mouth"), found.mouth), (say("blinks"), found.blinks))
    facts: list[str] = [say("{part} {r}", part=part, r=_points(r)) for part, r in named if r is not None]
    if found.lag_ms is not None:
        facts.append(_beside(round(found.lag_ms)))
    other = say("phone") if found.phone else say("other tracker")
    remedy: str = say("Correlations of their movements; 1 is the very same.")
    if mean < _ROUGHLY:
        check = say("Check that both see you alone, in good light, and calibrate both.")
        remedy = together(" ", remedy, check)
    severity = "minor" if mean < _ROUGHLY else "note"
    yield Finding(BESIDE, severity, _agrees(mean, other, together(", ", *facts)), remedy)


def _agrees(mean: float, other: str, facts: str) -> str:
    """How well the webcam follows the other tracker."""
    if mean >= _CLOSELY:
        return say("Your webcam follows the {tracker} closely: {facts}.", tracker=other, facts=facts)
    if mean >= _ROUGHLY:
        return say("Your webcam follows the {tracker} roughly: {facts}.", tracker=other, facts=facts)
    return say("Your webcam hardly follows the {tracker}: {facts}.", tracker=other, facts=facts)


def _beside(late: int) -> str:
    """How much later than the other the webcam is, milliseconds."""
    if not late:
        return say("at the same time")
    if late > 0:
        return say("{ms} ms later", ms=late)
    return say("{ms} ms earlier", ms=-late)


def _points(r: float) -> str:
    """A correlation as people write it: .93, -.20, 1.00."""
    return f"{r:.2f}".replace("0.", ".", 1)


def _agreement(text: str) -> Agreement | None:
    """What a take's facts say of it, None where they say nothing, or what cannot be."""
    try:
        plain = json.loads(text)
        numbers = {name: plain[name] for name in ("lag_ms", "jaw", "mouth", "blinks")}
        good = all(one is None or math.isfinite(one) for one in numbers.values())
        return Agreement(bool(plain["phone"]), **numbers) if good else None
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return None


def _longest(info: TakeInfo, why: str) -> tuple[float | None, float | None]:
    """The longest span that is left out for a reason."""
    found = [(start, end) for start, end, reason in info.left_out if reason == why]
    return max(found, key=lambda span: span[1] - span[0], default=(None, None))


def _share(text: str) -> float | None:
    """A share as a take's extra facts have it, None where there is none or it makes no sense."""
    try:
        share = float(text)
    except ValueError:
        return None
    return share if 0 <= share <= 1 else None
