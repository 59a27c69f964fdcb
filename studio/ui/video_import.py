"""Before videos are imported: the face model is offered where it is missing, and whose face it is asked."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QDialog, QHBoxLayout, QPushButton, QSizePolicy, QVBoxLayout, QWidget

from studio.errors import StudioError
from studio.ipc.events import ChildEvent, DownloadProgressEvent, FacesEvent
from studio.tracking import VIDEO_SUFFIXES, face_model
from studio.ui import messages, tasks, theme
from studio.ui.tasks import ChildTask
from studio.ui.widgets.card import label

Box = tuple[float, float, float, float]
LEAST_BOX = 0.04
"""Parts of the picture below which a drag is a click."""
_MOST_FILES = 2_000


class VideoQuestions(QObject):
    """Asks what has to be asked before paths are imported, and goes on with the answers.

    Args:
        window: over which it asks.
        go_on: called with further arguments of `saia import`; not called where the person cancels.
        show_status: shows a sentence and a part done; "" and None for nothing.
    """

    def __init__(
        self,
        window: QWidget,
        go_on: Callable[[list[str]], None],
        show_status: Callable[[str, float | None], None],
    ) -> None:
        super().__init__(window)
        self._window, self._show_status = window, show_status
        self._on_answered = go_on
        self._asking, self._getting = False, ""
        self._videos: tuple[Path, ...] = ()
        self._faces: FacesEvent | None = None
        self._getter, self._looker = ChildTask(self), ChildTask(self)
        self._getter.told.connect(self._on_getting)
        # With MediaPipe the model may be missing still.
        self._getter.done.connect(lambda _done: self._find(self._videos))
        self._looker.told.connect(self._on_look)
        self._looker.done.connect(lambda _done: self._choose())
        for task in (self._getter, self._looker):
            task.failed.connect(self._on_failed)
            task.cancelled.connect(self._on_cancelled)

    @property
    def running(self) -> bool:
        """Whether something is being fetched, looked at or asked."""
        return self._asking

    def ask(self, paths: tuple[Path, ...]) -> None:
        """Find the videos among paths, and ask about them."""
        self._asking = True
        self._find(paths)

    def _find(self, paths: tuple[Path, ...]) -> None:
        # Folders are read and a file is hashed: off the GUI thread.
        tasks.run(lambda: (videos_in(paths), face_model.missing()), self._on_found, owner=self)

    def cancel(self) -> None:
        """Import nothing after all."""
        self._getter.cancel()
        self._looker.cancel()

    def close(self) -> None:
        """The window closes."""
        self._getter.close()
        self._looker.close()

    def _on_found(self, found: tuple[tuple[Path, ...], StudioError | None]) -> None:
        self._videos, missing = found
        if self._videos and missing is not None:
            self._offer(missing.code)
        elif self._videos:
            self._look()
        else:
            self._go_on([])

    def _offer(self, missing: str) -> None:
        """Ask whether to fetch what is missing for tracking."""
        if missing == face_model.NO_PACKAGE:
            question = self.tr("MediaPipe is needed to read motion from videos.")
            details = self.tr("It is fetched once: {0}, Apache-2.0, from pypi.org.")
            details = details.format(face_model.PACKAGE_SIZE)
            yes, self._getting = self.tr("Get MediaPipe"), self.tr("Getting MediaPipe…")
            option = "--get-mediapipe"
        else:
            question = self.tr("The face model is needed to read motion from videos.")
            details = self.tr("It is fetched once: {0}.").format(face_model.facts())
            yes, self._getting = self.tr("Get the model"), self.tr("Getting the face model…")
            option = "--get-model"
        if messages.ask(self._window, question, details, yes, self.tr("Import only the sound")):
            self._show_status(self._getting, None)
            self._getter.start(["camera", option])
        else:
            self._go_on([])

    def _on_getting(self, event: ChildEvent) -> None:
        if isinstance(event, DownloadProgressEvent):
            self._show_status(self._getting, event.fraction)

    def _look(self) -> None:
        """Whose face is asked for one video; of many the largest is taken, or nobody would see the end."""
        if len(self._videos) != 1:
            self._go_on([])
            return
        self._faces = None
        self._show_status(self.tr("Looking for faces in {0}…").format(self._videos[0].name), None)
        self._looker.start(["camera", "--look", str(self._videos[0])])

    def _on_look(self, event: ChildEvent) -> None:
        if isinstance(event, FacesEvent):
            self._faces = event

    def _choose(self) -> None:
        found = self._faces
        self._show_status("", None)
        if found is None or len(found.faces) == 1:
            self._go_on([])
            return
        dialog = WhoseFaceDialog(self._window, self._videos[0].name, found)
        dialog.accepted.connect(lambda: self._go_on(dialog.args))
        dialog.rejected.connect(self._on_cancelled)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _go_on(self, args: list[str]) -> None:
        self._asking = False
        self._on_answered(args)

    def _on_cancelled(self) -> None:
        self._asking = False
        self._show_status("", None)

    def _on_failed(self, error: BaseException) -> None:
        self._on_cancelled()
        messages.show_error(self._window, error)


def videos_in(paths: tuple[Path, ...]) -> tuple[Path, ...]:
    """The videos among some files and folders, by their names; not all of a folder without end."""
    found = []
    for path in paths:
        files = [path]
        if path.is_dir():
            files = [file for file, _ in zip(path.rglob("*"), range(_MOST_FILES), strict=False)]
        found += [file for file in files if file.suffix.lower() in VIDEO_SUFFIXES]
    return tuple(found)


class WhoseFaceDialog(QDialog):
    """Whose face is it? A picture of the video to click a face in, or to draw a box.

    Attributes:
        args: what `saia import` is told.
    """

    def __init__(self, parent: QWidget, name: str, found: FacesEvent) -> None:
        super().__init__(parent)
        self.setObjectName("whose_face")
        self.setWindowTitle(self.tr("Whose face?"))
        self.setModal(True)
        self.args: list[str] = []
        pixmap = QPixmap()
        pixmap.loadFromData(base64.b64decode(found.jpeg), "JPEG")
        self.picture = FacePicture(pixmap, found.faces)
        self.picture.chosen.connect(self._on_chosen)
        if found.faces:
            text = self.tr("{0} shows {1} faces. Click yours, or drag a box around it.")
        else:
            text = self.tr("No face was found in {0}. If yours is small, drag a box around it.")
        words = label(text.format(name, len(found.faces)), "", "whose_face_words")
        words.setWordWrap(True)
        self.go = QPushButton(self.tr("Import"))
        self.go.setObjectName("whose_face_import")
        theme.as_role(self.go, "primary")
        self.go.clicked.connect(self.accept)
        sound = QPushButton(self.tr("Import only the sound"))
        sound.setObjectName("whose_face_sound")
        sound.clicked.connect(self._on_sound)
        cancel = QPushButton(self.tr("Cancel"))
        cancel.clicked.connect(self.reject)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addStretch(1)
        for button in (cancel, sound, self.go):
            row.addWidget(button)
        column = QVBoxLayout(self)
        column.setSpacing(theme.INSIDE)
        column.addWidget(words)
        column.addWidget(self.picture, 1)
        column.addLayout(row)
        self.resize(720, 560)
        sizes = [w * h for _, _, w, h in found.faces]
        self.go.setEnabled(bool(sizes))
        if sizes:
            self.picture.choose(sizes.index(max(sizes)))

    def _on_chosen(self, face: int, box: object) -> None:
        self.go.setEnabled(True)
        if isinstance(box, tuple):
            self.args = ["--box", ",".join(f"{100 * part:.2f}" for part in box)]
        else:
            self.args = ["--face", str(face + 1)]

    def _on_sound(self) -> None:
        self.args = ["--sound-only"]
        self.accept()


class FacePicture(QWidget):
    """A picture with faces framed.

    Signals:
        chosen: (number of a face from 0, None), or (-1, the box that was drawn as x, y, width, height).
    """

    chosen = Signal(int, object)

    def __init__(self, pixmap: QPixmap, faces: tuple[Box, ...]) -> None:
        super().__init__()
        self._pixmap, self._faces = pixmap, faces
        self._face, self._box = -1, QRectF()
        self._from: QPointF | None = None
        self.setMinimumSize(320, 200)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(self.tr("Faces of the video; the arrow keys choose one"))

    @property
    def shown(self) -> QRectF:
        """Where the picture lies in the widget."""
        size = self._pixmap.size().scaled(self.size(), Qt.AspectRatioMode.KeepAspectRatio)
        return QRectF(
            (self.width() - size.width()) / 2,
            (self.height() - size.height()) / 2,
            size.width(),
            size.height(),
        )

    def sizeHint(self) -> QSize:
        return QSize(640, 400)

    def choose(self, face: int) -> None:
        """Choose a face by its number from 0."""
        self._face, self._box = face, QRectF()
        self.update()
        self.chosen.emit(face, None)

    def keyPressEvent(self, event: object) -> None:
        key = event.key()  # type: ignore[attr-defined]
        step = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}.get(key, 0)
        if step and self._faces:
            self.choose((self._face + step) % len(self._faces))
        else:
            super().keyPressEvent(event)  # type: ignore[arg-type]

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._from = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._from is not None:
            self._box = QRectF(self._from, event.position()).normalized() & self.shown
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        start, self._from = self._from, None
        shown, box = self.shown, self._box
        if start is None:
            return
        if min(box.width() / shown.width(), box.height() / shown.height()) >= LEAST_BOX:
            self._face = -1
            x, y = (box.x() - shown.x()) / shown.width(), (box.y() - shown.y()) / shown.height()
            self.chosen.emit(-1, (x, y, box.width() / shown.width(), box.height() / shown.height()))
            return
        self._box = QRectF()
        hit = [i for i, one in enumerate(self._faces) if self._placed(one).contains(event.position())]
        if hit:
            self.choose(hit[0])
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawPixmap(self.shown, self._pixmap, QRectF(self._pixmap.rect()))
        for i, face in enumerate(self._faces):
            mine = i == self._face
            painter.setPen(QPen(theme.colour("accent" if mine else "text"), 3 if mine else 1.5))
            painter.drawRoundedRect(self._placed(face), 6, 6)
        if not self._box.isEmpty():
            painter.setPen(QPen(theme.colour("accent"), 2, Qt.PenStyle.DashLine))
            painter.drawRect(self._box)

    def _placed(self, face: Box) -> QRectF:
        shown = self.shown
        x, y, w, h = face
        return QRectF(
            shown.x() + x * shown.width(),
            shown.y() + y * shown.height(),
            w * shown.width(),
            h * shown.height(),
        )
