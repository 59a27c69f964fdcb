"""Presenter of the webcam's page: its camera in a child process, its model, and its hints in words."""

from __future__ import annotations

import base64
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.files.atomic import size_text
from studio.ipc.commands import Command
from studio.ipc.events import (
    CameraDone,
    CameraEvent,
    CameraPreviewEvent,
    CameraStartedEvent,
    CameraStatusEvent,
    ChildEvent,
    DownloadProgressEvent,
    FaceModelEvent,
)
from studio.tracking import VIDEO_SUFFIXES
from studio.tracking.face import Calibration
from studio.tracking.face_model import PACKAGE_SIZE
from studio.tracking.pictures import HINTS
from studio.tracking.webcam import load_calibration
from studio.ui import messages, tasks
from studio.ui.language import native, sentences
from studio.ui.record.model import RecordModel
from studio.ui.record.webcam_view import VIDEO, WebcamPane
from studio.ui.session import Session
from studio.ui.tasks import ChildTask

DIGITS = 12
"""Of a checksum, enough to tell it by; all of them are in the tooltip."""
_NO_PREVIEW, _PREVIEW = Command("preview", "off"), Command("preview", "on")


class WebcamPresenter(QObject):
    """Starts and stops the camera; it goes on when the page is closed, until somebody stops it."""

    def __init__(self, pane: WebcamPane, model: RecordModel, session: Session) -> None:
        super().__init__(pane)
        self._pane, self._model, self._session = pane, model, session
        self._device = session.settings.camera
        self._cameras: list[tuple[str, str]] = []
        self._facts = FaceModelEvent(here=True, runs=True)
        # Where it sends; "" while it is off or about to stop.
        self._on = False
        self._again = False
        self._camera, self._getter, self._lister = ChildTask(self), ChildTask(self), ChildTask(self)
        self._camera.told.connect(self._on_told)
        self._camera.failed.connect(self._on_failed)
        self._camera.ended.connect(self._on_ended)
        self._lister.told.connect(self._on_listed)
        self._lister.done.connect(lambda _done: self._show_cameras())
        self._lister.failed.connect(lambda error: messages.show_error(pane, error))
        self._getter.told.connect(self._on_progress)
        self._getter.done.connect(self._on_model)
        self._getter.failed.connect(self._on_no_model)
        self._getter.cancelled.connect(self._show_model)
        pane.toggled.connect(self.set_on)
        pane.device_chosen.connect(self._on_device)
        pane.mode_chosen.connect(lambda mode: session.change_settings(camera_mode=mode))
        pane.calibrate_requested.connect(lambda: self._camera.tell(Command("calibrate")))
        pane.gain_chosen.connect(self._on_gain)
        pane.model_requested.connect(self._on_get)
        pane.model_file_requested.connect(self._on_choose)
        pane.refresh_requested.connect(self.look)
        pane.show_mode(session.settings.camera_mode)
        model.webcam_stop_requested.connect(lambda: self.set_on(False))
        session.settings_changed.connect(self._on_settings)
        self._show_idle()

    @property
    def on(self) -> bool:
        """Whether the camera is on, or about to be."""
        return self._on

    def look(self) -> None:
        """Look for cameras and for the model; the page is shown."""
        self._cameras.clear()
        tasks.run(load_calibration, self._show_gains, owner=self)
        self._lister.start(["camera"])
        self._camera.tell(_PREVIEW)

    def rest(self) -> None:
        """The page is closed: the camera goes on without showing itself."""
        self._camera.tell(_NO_PREVIEW)

    def set_on(self, on: bool) -> None:
        """Start or stop the camera."""
        if on == self._on:
            return
        if on and not self._session.rolling:
            # Before it is on: it starts with the port that is chosen then.
            self._model.use_a_free_port()
        self._on = on
        self._pane.show_running(on)
        if on:
            self._pane.show_hint(self.tr("Opening the camera…"), "")
            self._start()
        else:
            self._camera.stop()
            self._camera.cancel()
        self._tell("")

    def close(self) -> None:
        """The window closes: let go of the camera."""
        for task in (self._camera, self._getter, self._lister):
            task.close()

    def _start(self) -> None:
        if self._camera.running:
            # Two programs cannot have one camera.
            self._again = True
            self._camera.cancel()
            return
        device = ["--device", self._device] if self._device else []
        to = f"127.0.0.1:{self._session.settings.vmc_port}"
        size, _, fps = str(self._pane.mode.currentData()).partition("@")
        mode = ["--size", size, "--fps", fps]
        self._camera.start(["camera", "--to", to, "--preview", *mode, *device])

    def _tell(self, sender: str) -> None:
        self._model.webcam_sender = sender
        self._model.webcam_changed.emit(self._on)

    # -- what the camera says --------------------------------------------------------------------

    def _on_told(self, event: ChildEvent) -> None:
        match event:
            case CameraStartedEvent():
                self._tell(event.sender)
                if not self._pane.isVisible():
                    self.rest()
            case CameraStatusEvent():
                self._show_status(event)
            case CameraPreviewEvent() if event.jpeg and self._on:
                self._pane.show_picture(base64.b64decode(event.jpeg))

    def _show_status(self, now: CameraStatusEvent) -> None:
        if not self._on:
            return
        pane = self._pane
        pane.show_calibrating(now.calibrating, now.calibrated)
        if now.calibrating:
            pane.show_hint(self.tr("Look straight ahead with a calm face."), "")
        elif now.hints:
            text = native(HINTS[now.hints[0]])
            pane.show_hint(text.format(fps=now.fps), "warn")
        else:
            tip = (
                "" if now.calibrated else self.tr(" Calibrate once, so that your calm face is the avatar's.")
            )
            pane.show_hint(self.tr("Your face is tracked.") + tip, "good")
        rate = self.tr("{0:.0f} frames a second, {1:.0f} ms from picture to motion")
        pane.show_rate(rate.format(now.fps, now.delay_ms) if now.fps else "")

    def _on_failed(self, error: BaseException) -> None:
        self._on = self._again = False
        self._pane.show_running(False)
        if isinstance(error, StudioError):
            self._pane.show_hint(sentences(error.what, error.in_window), "warn")
            if not self._pane.isVisible():
                messages.show_error(self._pane.window(), error)
        else:
            messages.show_error(self._pane, error)
        self._tell("")

    def _on_ended(self) -> None:
        if self._again and self._on:
            self._again = False
            self._start()
        elif not self._on:
            self._show_idle()

    def _show_gains(self, kept: Calibration | None) -> None:
        self._pane.show_gains(kept.gains if kept is not None else {})

    def _on_gain(self, shape: str, factor: float) -> None:
        self._camera.tell(Command("gain", f"{shape}={factor:g}"))

    def _show_idle(self) -> None:
        self._pane.show_running(False)
        self._pane.show_hint(self.tr("Your face moves the avatar: mouth, eyes, brows and head."), "")

    def _on_settings(self, changed: frozenset[str]) -> None:
        """The port that is listened to has changed: the camera sends there."""
        if "vmc_port" in changed and self._on:
            self._start()

    # -- which camera ----------------------------------------------------------------------------

    def _on_listed(self, event: ChildEvent) -> None:
        if isinstance(event, CameraEvent):
            self._cameras.append((event.id, event.title))
        elif isinstance(event, FaceModelEvent):
            self._facts = event
            self._show_model()

    def _show_cameras(self) -> None:
        known = any(camera == self._device for camera, _ in self._cameras)
        # One that was unplugged since gives way to those that are here.
        if self._device and not known and not Path(self._device).is_file():
            self._device = ""
        self._pane.show_cameras(self._cameras, self._device)

    def _on_device(self, device: str) -> None:
        if device == VIDEO:
            endings = " ".join(f"*{suffix}" for suffix in sorted(VIDEO_SUFFIXES))
            title, kinds = self.tr("Play a video as a camera"), self.tr("Videos ({0})").format(endings)
            device = QFileDialog.getOpenFileName(self._pane, title, "", kinds)[0] or self._device
        self._device = device
        # A video is played once; only a camera is there again tomorrow.
        if device in (camera for camera, _ in self._cameras):
            self._session.change_settings(camera=device)
        self._show_cameras()

    # -- the model -------------------------------------------------------------------------------

    def _show_model(self) -> None:
        facts = self._facts
        if not facts.runs:
            text = self.tr("Tracking a face needs MediaPipe, once: {0}, Apache-2.0, from pypi.org.")
            self._pane.show_model(text.format(PACKAGE_SIZE), self.tr("Get MediaPipe"), False, file=False)
        elif not facts.here:
            text = self.tr("The face model is needed once: {0}, {1}, from {2}. SHA-256 {3}…")
            size, host = size_text(facts.size), facts.url.split("/")[2]
            self._pane.show_model(
                text.format(size, facts.licence, host, facts.sha256[:DIGITS]),
                self.tr("Get the model"),
                False,
                tip=f"SHA-256 {facts.sha256}",
            )
        else:
            self._pane.show_model("", "", True)

    def _on_get(self) -> None:
        if self._getter.running:
            self._getter.cancel()
        elif not self._facts.runs:
            self._getter.start(["camera", "--get-mediapipe"])
            text = self.tr("Getting MediaPipe ({0})… This takes some minutes.").format(PACKAGE_SIZE)
            self._pane.show_model(text, self.tr("Cancel"), False, file=False)
        else:
            self._getter.start(["camera", "--get-model"])
            self._pane.show_model(self.tr("Getting the face model…"), self.tr("Cancel"), False)

    def _on_choose(self) -> None:
        title, kinds = self.tr("Choose the face model"), self.tr("Face model (*.task)")
        found = QFileDialog.getOpenFileName(self._pane, title, "", kinds)[0]
        if found:
            self._getter.start(["camera", "--get-model", found])

    def _on_progress(self, event: ChildEvent) -> None:
        if isinstance(event, DownloadProgressEvent):
            text = self.tr("Getting the face model… {0:.0%}").format(event.fraction)
            self._pane.show_model(text, self.tr("Cancel"), False)

    def _on_model(self, _done: CameraDone) -> None:
        # MediaPipe or the model: one of them may be missing still.
        self._pane.show_model("", "", False)
        self.look()

    def _on_no_model(self, error: BaseException) -> None:
        self._show_model()
        messages.show_error(self._pane, error)
