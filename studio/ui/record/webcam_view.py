"""The webcam's page among the trackers: what the camera sees, what would make it better, and a button."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSpinBox,
    QVBoxLayout,
)

from studio.motion.channels import ARKIT_SHAPES
from studio.ui import theme
from studio.ui.widgets.card import Card, Picture, label

VIDEO = "*video*"
"""Value of the entry that asks for a video file."""
MOST_PERCENT = 300
MODES = ("640x480@30", "640x480@60", "1280x720@30", "1280x720@60", "1920x1080@30")
"""Sizes and rates a camera may be asked for, as WxH@FPS."""


class WebcamPane(Card):
    """A camera as a tracker.

    Signals:
        toggled: start or stop the camera.
        device_chosen: a camera's id, or VIDEO.
        mode_chosen: one of MODES.
        gain_chosen: a shape's name and the factor that makes it stronger or weaker.
        calibrate_requested: take the face as it is now for the face at rest.
        model_requested: fetch what is missing, the face model or MediaPipe, or give that up.
        model_file_requested: choose the face model from disk.
        refresh_requested: look for cameras again.
        finished: close the page.
    """

    toggled = Signal(bool)
    device_chosen = Signal(str)
    mode_chosen = Signal(str)
    gain_chosen = Signal(str, float)
    calibrate_requested = Signal()
    model_requested = Signal()
    model_file_requested = Signal()
    refresh_requested = Signal()
    finished = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("webcam")
        self._on = False
        self._gains: dict[str, float] = {}
        self.picture = QLabel()
        self.picture.setObjectName("webcam_picture")
        self.picture.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.picture.setMinimumSize(320, 240)
        self.picture.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.device = QComboBox()
        self.device.setObjectName("webcam_device")
        self.device.setAccessibleName(self.tr("Camera"))
        self.device.activated.connect(lambda _i: self.device_chosen.emit(str(self.device.currentData())))
        self.mode = QComboBox()
        self.mode.setObjectName("webcam_mode")
        self.mode.setAccessibleName(self.tr("Picture size and rate"))
        tip = self.tr(
            "What the camera is asked for; one that cannot gives its own. Larger pictures show a face from "
            "farther away, 60 fps follow it more closely; both need a faster computer and more light."
        )
        self.mode.setToolTip(tip)
        for mode in MODES:
            size, _, fps = mode.partition("@")
            self.mode.addItem(self.tr("{0}, {1} fps").format(size.replace("x", " × "), fps), mode)
        self.mode.activated.connect(lambda _i: self.mode_chosen.emit(str(self.mode.currentData())))
        self.refresh = QPushButton()
        theme.set_icon(self.refresh, "mdi6.refresh", "muted")
        self.refresh.setToolTip(self.tr("Look for cameras again"))
        self.refresh.setAccessibleName(self.tr("Look for cameras again"))
        self.refresh.setAutoDefault(False)
        self.refresh.clicked.connect(self.refresh_requested)
        self._light = Picture("mdi6.webcam", 18)
        self.hint = label("", "", "webcam_hint")
        self.hint.setWordWrap(True)
        self.rate = label("", "caption", "webcam_rate")
        self.toggle = self._button("webcam_toggle", lambda: self.toggled.emit(not self._on))
        theme.as_role(self.toggle, "primary")
        self.calibrate = self._button("webcam_calibrate", self.calibrate_requested.emit)
        self._build_gains()
        self._model_text = label("", "", "webcam_model")
        self._model_text.setWordWrap(True)
        self._model_text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.get_model = self._button("webcam_get_model", self.model_requested.emit)
        theme.as_role(self.get_model, "primary")
        self.choose_model = self._button("webcam_choose_model", self.model_file_requested.emit)
        self.choose_model.setText(self.tr("Choose the file…"))
        self._lay_out()
        self.show_running(False)
        self.show_calibrating(0.0, False)
        self.show_model("", "", True)

    def show_cameras(self, cameras: Sequence[tuple[str, str]], chosen: str) -> None:
        """List cameras as (id, title), and the entry for a video file."""
        self.device.clear()
        for camera, title in cameras:
            self.device.addItem(title, camera)
        if not cameras:
            self.device.addItem(self.tr("No camera found"), "")
        if chosen and self.device.findData(chosen) < 0:
            self.device.addItem(chosen.replace("\\", "/").rpartition("/")[2], chosen)
        self.device.addItem(self.tr("Play a video instead…"), VIDEO)
        self.device.setCurrentIndex(max(self.device.findData(chosen), 0) if chosen else 0)

    def show_mode(self, mode: str) -> None:
        """Show the size and rate that are asked for; those of another list are the first."""
        self.mode.setCurrentIndex(max(self.mode.findData(mode), 0))

    def show_gains(self, gains: Mapping[str, float]) -> None:
        """Show factors of shapes by name; 1 where none is named."""
        self._gains = dict(gains)
        self._show_gain()

    def show_running(self, on: bool) -> None:
        """Show whether the camera is on."""
        self._on = on
        self.toggle.setText(self.tr("Stop the webcam") if on else self.tr("Start the webcam"))
        self.calibrate.setEnabled(on)
        tip = self.tr("Makes this part of the face move more or less than the camera sees it.")
        tip += " " + (self.tr("It is remembered.") if on else self.tr("Start the webcam to change it."))
        for control in (self._gain_title, self.shape, self.gain):
            control.setToolTip(tip)
            control.setEnabled(on)
        rest = self.tr("Look ahead with a calm face for two seconds; that becomes the avatar's rest.")
        self.calibrate.setToolTip(rest if on else self.tr("Start the webcam to calibrate it."))
        self.device.setEnabled(not on)
        self.mode.setEnabled(not on)
        self.refresh.setEnabled(not on)
        if not on:
            self.picture.setPixmap(QPixmap())
            self.picture.setText(self.tr("Pictures stay on this computer and are never stored."))
            self.rate.setText("")

    def show_hint(self, text: str, health: str) -> None:
        """Say what would make it better; health is "good", "warn" or ""."""
        icons = {"good": ("mdi6.check-circle", "good"), "warn": ("mdi6.alert", "warn")}
        self._light.set_icon(*icons.get(health, ("mdi6.webcam", "muted")))
        self.hint.setText(text)
        theme.as_role(self.hint, health or "muted")

    def show_rate(self, text: str) -> None:
        """Say how fast and how late it is."""
        self.rate.setText(text)

    def show_calibrating(self, seconds: float, calibrated: bool) -> None:
        """Show how long a calibration still takes, 0 for none."""
        again = self.tr("Calibrate again") if calibrated else self.tr("Calibrate")
        self.calibrate.setText(self.tr("Hold still… {0:.0f}").format(seconds + 0.5) if seconds else again)

    def show_picture(self, jpeg: bytes) -> None:
        """Show what the camera sees."""
        found = QPixmap()
        if found.loadFromData(jpeg, "JPEG"):
            mode = Qt.TransformationMode.SmoothTransformation
            self.picture.setPixmap(
                found.scaled(self.picture.size(), Qt.AspectRatioMode.KeepAspectRatio, mode)
            )

    def show_model(self, text: str, button: str, may_start: bool, file: bool = True, tip: str = "") -> None:
        """Say what is missing for tracking.

        Args:
            text: a sentence, "" for nothing.
            button: what fetches it, "" where that would not help.
            may_start: nothing is missing.
            file: it may be chosen from disk instead.
            tip: more of the sentence, in its tooltip.
        """
        self._model_text.setToolTip(tip)
        self.toggle.setToolTip("" if may_start else text)
        self._model_text.setText(text)
        self._model_text.setVisible(bool(text))
        self.get_model.setText(button)
        self.get_model.setVisible(bool(button))
        self.choose_model.setVisible(bool(button) and file)
        self.toggle.setEnabled(may_start)

    def _build_gains(self) -> None:
        self._gain_title = label(self.tr("Strength"), "caption")
        self.shape = QComboBox()
        self.shape.setObjectName("webcam_shape")
        self.shape.setAccessibleName(self.tr("Part of the face"))
        # Nobody sees the tongue.
        for name in sorted(set(ARKIT_SHAPES) - {"TongueOut"}):
            self.shape.addItem(re.sub(r"(?<!^)(?=[A-Z])", " ", name).capitalize(), name)
        self.shape.setCurrentIndex(self.shape.findData("JawOpen"))
        self.shape.activated.connect(lambda _i: self._show_gain())
        self.gain = QSpinBox()
        self.gain.setObjectName("webcam_gain")
        self.gain.setRange(0, MOST_PERCENT)
        self.gain.setSingleStep(10)
        self.gain.setSuffix(" %")
        self.gain.setAccessibleName(self.tr("How strong"))
        self.gain.valueChanged.connect(self._on_gain)
        self._show_gain()

    def _show_gain(self) -> None:
        self.gain.blockSignals(True)
        self.gain.setValue(round(100 * self._gains.get(str(self.shape.currentData()), 1.0)))
        self.gain.blockSignals(False)

    def _on_gain(self, percent: int) -> None:
        shape = str(self.shape.currentData())
        self._gains[shape] = percent / 100
        self.gain_chosen.emit(shape, percent / 100)

    def _button(self, name: str, act: object) -> QPushButton:
        button = QPushButton()
        button.setObjectName(name)
        button.setAutoDefault(False)
        button.clicked.connect(act)
        return button

    def _lay_out(self) -> None:
        body = self.body
        choice = QHBoxLayout()
        choice.setSpacing(theme.INSIDE)
        choice.addWidget(self.device, 1)
        choice.addWidget(self.mode)
        choice.addWidget(self.refresh)
        body.addWidget(label(self.tr("This webcam"), "title"))
        body.addLayout(choice)
        body.addWidget(self.picture, 1)
        light = QHBoxLayout()
        light.setSpacing(theme.INSIDE)
        light.addWidget(self._light)
        texts = QVBoxLayout()
        texts.setSpacing(0)
        texts.addWidget(self.hint)
        texts.addWidget(self.rate)
        light.addLayout(texts, 1)
        light.addWidget(self._gain_title)
        light.addWidget(self.shape)
        light.addWidget(self.gain)
        body.addLayout(light)
        body.addWidget(self._model_text)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for button in (self.get_model, self.choose_model):
            row.addWidget(button)
        row.addStretch(1)
        close = self._button("webcam_done", self.finished.emit)
        close.setText(self.tr("Done"))
        for button in (self.calibrate, close, self.toggle):
            row.addWidget(button)
        body.addLayout(row)
