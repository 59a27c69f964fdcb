"""What a take's pictures were like, as findings: the face in them, and a phone that saw it too."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

from studio.motion.filmed import BESIDE, HIDDEN, Agreement
from studio.take.take import Finding, TakeInfo

_FILMED: tuple[tuple[str, float, float, str, str], ...] = (
    ("face_turned", 0.1, 0.4, "The head is turned too far from the camera", "Look towards the camera."),
    (
        "face_blurred",
        0.2,
        0.6,
        "The picture is blurred",
        "Add light, hold the camera still or clean its lens.",
    ),
    ("mouth_hidden", 0.02, 0.4, "The mouth is hidden", "Keep hands and the microphone away from your lips."),
    ("face_dark", 0.2, 0.6, "The face is too dark", "Turn a lamp towards the face."),
    ("face_small", 0.2, 0.6, "The face is too small", "Come closer to the camera, or film with more pixels."),
)
"""What is said from which share of the frames on, as a minor and as a major fault."""
_CLOSELY = (("follows the {} closely", 0.8), ("follows the {} roughly", 0.5))
_HARDLY = "hardly follows the {}"
"""What a mean correlation is called from where on."""


def filmed_findings(info: TakeInfo) -> Iterator[Finding]:
    """What the pictures say that the motion was tracked in."""
    shares = {name: _share(info.extra.get(name, "")) for name in ("face_seen", *(one[0] for one in _FILMED))}
    seen = shares["face_seen"]
    if seen is not None and seen < 0.995:
        what = f"A face was seen in {min(seen, 0.99):.0%} of the pictures."
        severity = "major" if seen < 0.5 else "minor" if seen < 0.9 else "note"
        yield Finding(
            "face_lost", severity, what, "The other parts are left out; look whether all of them should be."
        )
    for name, minor, major, what, remedy in _FILMED:
        share = shares[name]
        if share is not None and share >= minor:
            severity = "major" if share >= major else "minor"
            at, until = _longest(info, HIDDEN) if name == "mouth_hidden" else (None, None)
            yield Finding(name, severity, f"{what} in {share:.0%} of the frames.", remedy, at, until)


def beside_findings(info: TakeInfo) -> Iterator[Finding]:
    """How well a webcam agrees with a phone, or another tracker, that saw the same face at once."""
    found = _agreement(info.extra.get(BESIDE, ""))
    if found is None:
        return
    known = [r for r in (found.jaw, found.mouth, found.blinks) if r is not None]
    if not known:
        return
    mean = sum(known) / len(known)
    how = next((word for word, least in _CLOSELY if mean >= least), _HARDLY)
    other = "phone" if found.phone else "other tracker"
    facts = [
        f"{name} {_points(r)}"
        for name, r in (("jaw", found.jaw), ("mouth", found.mouth), ("blinks", found.blinks))
        if r is not None
    ]
    if found.lag_ms is not None:
        late = round(found.lag_ms)
        facts.append(
            "at the same time" if not late else f"{abs(late)} ms {'later' if late > 0 else 'earlier'}"
        )
    remedy = "Correlations of their movements; 1 is the very same."
    if how == _HARDLY:
        remedy = f"{remedy} Check that both see you alone, in good light, and calibrate both."
    severity = "minor" if how == _HARDLY else "note"
    yield Finding(BESIDE, severity, f"Your webcam {how.format(other)}: {', '.join(facts)}.", remedy)


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
    except (ValueError, TypeError, KeyError):
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
