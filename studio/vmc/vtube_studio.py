"""VTube Studio's packets: what its app on a phone sends for some seconds to whoever asks it. Pure.

Source: DenchiSoft's VTubeStudioBlendshapeUDPReceiverTest: its README for the request and the ports, its raw
tracking data for the packet (JSON, a shape as {"k": name, "v": weight}, degrees), and its example, which
turns a cube that faces the person like a mirror by (-y, -x, z). Without the mirror that is a pitch of y, a
yaw of x and a roll of z about Unity's axes: worked out, and not tried with a phone. Where the eyes look is
told by the shapes as well, and read there.
"""

from __future__ import annotations

import json

from studio.vmc.osc import AbsurdError, MalformedError

VTUBE_STUDIO, VTUBE_STUDIO_PORT = "VTube Studio", 11125
"""The kind of its senders, and the port that it is asked to send to."""
PHONE_PORT = 21412
"""Where the app listens for requests."""
ASKED_S = 5.0
"""Seconds that one request is good for; the app allows 0.5 to 10."""


def request(port: int) -> bytes:
    """What the app is to be sent to have it send its face to a port."""
    content = {
        "messageType": "iOSTrackingDataRequest", "time": ASKED_S, "sentBy": "Saia Studio", "ports": [port],
    }  # fmt: skip
    return json.dumps(content).encode()


def recognises(datagram: bytes) -> bool:
    """Whether a datagram is VTube Studio's, at a glance."""
    return datagram.startswith(b"{") and b'"BlendShapes"' in datagram


def read(datagram: bytes) -> tuple[dict[str, float], tuple[float, float, float] | None]:
    """One face that `recognises` knows.

    Returns:
        Weights by the names of the app, and the head's pitch, yaw and roll in degrees; none of both where it
        sees no face.

    Raises:
        AbsurdError: it is none of its packets.
        MalformedError: a part is damaged.
    """
    try:
        content = json.loads(datagram)
    except (ValueError, RecursionError) as error:
        raise AbsurdError("the face is no JSON") from error
    if not isinstance(content, dict) or not isinstance(content.get("BlendShapes"), list):
        raise AbsurdError("there is no face in it")
    if content.get("FaceFound") is not True:
        return {}, None
    try:
        shapes = {str(one["k"]): float(one["v"]) for one in content["BlendShapes"]}
        turn = content["Rotation"]
        yaw, pitch, roll = (float(turn[axis]) for axis in "xyz")
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        # JSON has whole numbers of any length, and those of 400 digits are no float.
        raise MalformedError("the face is cut off") from error
    return shapes, (pitch, yaw, roll)
