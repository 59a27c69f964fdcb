"""Avatars as three-vrm draws them in a browser and as the studio does: how alike, and how fast.

Needs Chromium, node and npm, and the sample avatars (SAIA_DATA). All pictures are kept
as results/avatar.png.
"""

from __future__ import annotations

import base64
import http.server
import io
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio import virtual_devices

SIDE, TIMES = 640, 120
VIEWS = {"body": (-20.0, 4.0, 1.0), "face": (-20.0, 2.0, 0.3)}
"""Azimuth, elevation and zoom of the cameras."""
FACES: dict[str, dict[str, float]] = {"rest": {}, "aa": {"aa": 1.0}, "blink": {"blink": 1.0}}
PAGE = Path(__file__).resolve().parent / "foreign" / "draw_avatar.html"
GREY = 128.0
ACROSS = 2
Picture = NDArray[np.float64]


def run() -> dict[str, Any]:
    """SSIM, CIEDE2000 within the silhouette and its overlap, by avatar, face and view; pictures a second."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from tests.formats.foreign_node import node_folder

    with ExitStack() as stack:
        if not virtual_devices.has_screen():
            os.environ["DISPLAY"] = stack.enter_context(virtual_devices.virtual_screen())
        browser = stack.enter_context(Browser(node_folder()))
        result: dict[str, Any] = {"load_1_min": os.getloadavg()[0]}
        pairs: list[tuple[Picture, Picture]] = []
        for path in avatars():
            result[path.stem] = compared(path, browser, pairs) | {"speed": speed(path)}
        keep(pairs)
        return result


def avatars() -> list[Path]:
    """The studio's own, and those of the sample data."""
    from studio.project.avatars import OWN

    data = Path(os.environ.get("SAIA_DATA", "../shared/data")) / "vrm"
    return [OWN, *sorted(data.glob("*.vrm"))]


def compared(path: Path, browser: Browser, pairs: list[tuple[Picture, Picture]]) -> dict[str, Any]:
    """One avatar by both; the pictures are added to `pairs`."""
    from studio import formats
    from studio.render import toon
    from studio.render.camera import FIELD_OF_VIEW, Orbit
    from studio.render.scene import BODY, RenderScene
    from studio.render.world_pose import ARMS_DOWN, WorldPose

    avatar, found = formats.read_avatar(path), {}
    rest = WorldPose.rest_pose(avatar.skeleton)
    with RenderScene() as scene:
        scene.set_avatar(avatar)
        for face, shapes in FACES.items():
            if face != "rest" and not avatar.has_face:
                continue
            for view, (azimuth, elevation, zoom) in VIEWS.items():
                orbit = Orbit(azimuth, elevation, zoom)
                scene.place(BODY, WorldPose(rest.skeleton, rest.joints, rest.turns, shapes))
                ours = over_grey(scene.figure(orbit, SIDE, SIDE))
                camera = scene.camera(orbit)
                down = math.radians(ARMS_DOWN)
                job: dict[str, Any] = {
                    "width": SIDE, "height": SIDE, "view": FIELD_OF_VIEW, "camera": camera[:3],
                    "target": camera[3:],
                    "arms": {"leftUpperArm": -down, "rightUpperArm": down}, "expressions": shapes,
                    "light": toon.LIGHT, "ambient": toon.AMBIENT, "key": toon.KEY, "fill": toon.FILL,
                }  # fmt: skip
                theirs = of_png(browser.drawn(path, job))
                found[f"{face} {view}"] = likeness(*ours, *theirs)
                pairs.append((ours[0], theirs[0]))
    return found


def likeness(ours: Picture, our_mask: Picture, theirs: Picture, their_mask: Picture) -> dict[str, float]:
    """How alike two pictures are where either has something."""
    from skimage.color import deltaE_ciede2000, rgb2lab
    from skimage.metrics import structural_similarity

    either, both = (our_mask > 0.5) | (their_mask > 0.5), (our_mask > 0.5) & (their_mask > 0.5)
    _, similar = structural_similarity(ours, theirs, channel_axis=2, data_range=255.0, full=True)
    colour = deltaE_ciede2000(rgb2lab(ours / 255.0), rgb2lab(theirs / 255.0))
    return {
        "ssim": round(float(similar[either].mean()), 4), "ciede2000": round(float(colour[both].mean()), 3),
        "silhouette_iou": round(float(both.sum() / max(either.sum(), 1)), 4),
    }  # fmt: skip


def speed(path: Path) -> dict[str, float]:
    """Pictures a second at 1280 x 720 of a face that speaks, and how late the latest of a hundred is, ms."""
    from studio import formats
    from studio.render.camera import Orbit
    from studio.render.scene import BODY, RenderScene
    from studio.render.world_pose import WorldPose

    start = time.perf_counter()
    avatar = formats.read_avatar(path)
    read = time.perf_counter() - start
    rest, took = WorldPose.rest_pose(avatar.skeleton), []
    with RenderScene() as scene:
        start = time.perf_counter()
        scene.set_avatar(avatar)
        scene.place(BODY, rest)
        scene.figure(Orbit(-20, 4, 0.6), 1280, 720)
        first = time.perf_counter() - start
        for step in range(TIMES):
            shapes = {"jawOpen": 0.5 + 0.5 * math.sin(step / 3), "aa": 0.5 + 0.5 * math.sin(step / 3)}
            start = time.perf_counter()
            scene.place(BODY, WorldPose(rest.skeleton, rest.joints, rest.turns, shapes, step / 60))
            scene.figure(Orbit(-20, 4, 0.6), 1280, 720)
            took.append(time.perf_counter() - start)
    return {
        "read_s": round(read, 3), "first_picture_s": round(first, 3),
        "pictures_per_s": round(1 / statistics.median(took), 1),
        "99th_ms": round(1e3 * float(np.percentile(took, 99)), 1),
    }  # fmt: skip


def over_grey(layer: Any) -> tuple[Picture, Picture]:
    """A layer of the studio's as a whole picture over grey, and its alpha."""
    whole = np.zeros((SIDE, SIDE, 4))
    high, wide = layer.pixels.shape[:2]
    whole[layer.y : layer.y + high, layer.x : layer.x + wide] = layer.pixels
    alpha = whole[..., 3:] / 255.0
    return whole[..., :3] + GREY * (1.0 - alpha), alpha[..., 0]


def of_png(data: bytes) -> tuple[Picture, Picture]:
    """A browser's picture over grey, and its alpha."""
    from PIL import Image

    pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"), dtype=np.float64)
    alpha = pixels[..., 3:] / 255.0
    return pixels[..., :3] * alpha + GREY * (1.0 - alpha), alpha[..., 0]


def keep(pairs: list[tuple[Picture, Picture]]) -> None:
    """All pictures as one, ours at the left of theirs, in the order of the figures."""
    from PIL import Image

    tiles = [np.clip(np.concatenate(pair, axis=1), 0, 255).astype(np.uint8) for pair in pairs]
    tiles += [np.full_like(tiles[0], int(GREY))] * (-len(tiles) % ACROSS)
    rows = [np.concatenate(tiles[k : k + ACROSS], axis=1) for k in range(0, len(tiles), ACROSS)]
    sheet = Image.fromarray(np.concatenate(rows))
    sheet = sheet.resize((sheet.width // 2, sheet.height // 2)).quantize(128)
    sheet.save(Path(__file__).resolve().parent / "results" / "avatar.png", optimize=True)


class Browser:
    """A headless Chromium that draws avatars, started anew for each picture.

    Args:
        modules: a folder with `node_modules`.
    """

    def __init__(self, modules: Path) -> None:
        self._modules = modules
        self._program = next(
            filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
        )
        self._job: dict[str, Any] = {}
        self._avatar = Path()
        self._told: dict[str, Any] = {}
        self._answered = threading.Event()

    def __enter__(self) -> Browser:
        if self._program is None:
            raise RuntimeError("Chromium is not installed: three-vrm has nowhere to draw.")
        browser = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                browser._serve(self)

            def do_POST(self) -> None:
                browser._hear(self)

            def log_message(self, *_words: Any) -> None:
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    def drawn(self, avatar: Path, job: dict[str, Any]) -> bytes:
        """The PNG of an avatar."""
        self._avatar, self._job = avatar, job
        self._answered.clear()
        assert self._program is not None
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            command = [
                self._program, "--headless", "--no-sandbox", "--disable-quic", "--no-first-run",
                "--disable-sync", "--disable-background-networking", "--disable-component-update",
                "--use-gl=angle",
                "--use-angle=swiftshader", "--enable-unsafe-swiftshader", f"--user-data-dir={profile}",
                "--remote-debugging-port=0", f"http://127.0.0.1:{self._server.server_port}/",
            ]  # fmt: skip
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as child:
                answered = self._answered.wait(120.0)
                child.terminate()
                child.wait()
        if not answered or "picture" not in self._told:
            raise RuntimeError(f"three-vrm drew nothing: {self._told.get('error', 'no answer')}")
        return base64.b64decode(self._told["picture"].partition(",")[2])

    def _serve(self, request: http.server.BaseHTTPRequestHandler) -> None:
        path = request.path.partition("?")[0]
        if path == "/":
            body, kind = PAGE.read_bytes(), "text/html"
        elif path == "/job.json":
            body, kind = json.dumps(self._job).encode(), "application/json"
        elif path == "/avatar.vrm":
            body, kind = self._avatar.read_bytes(), "model/gltf-binary"
        else:
            file = self._modules / path.lstrip("/")
            if not (path.startswith("/node_modules/") and ".." not in path and file.is_file()):
                request.send_error(404)
                return
            body, kind = file.read_bytes(), "text/javascript"
        request.send_response(200)
        request.send_header("Content-Type", kind)
        request.send_header("Content-Length", str(len(body)))
        request.end_headers()
        request.wfile.write(body)

    def _hear(self, request: http.server.BaseHTTPRequestHandler) -> None:
        self._told = json.loads(request.rfile.read(int(request.headers["Content-Length"])))
        request.send_response(204)
        request.end_headers()
        self._answered.set()
