"""An avatar's faces: each shape, what moves it, a try, and a person's correction."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QCoreApplication, QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QCompleter,
    QDialog,
    QHBoxLayout,
    QPushButton,
    QSlider,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.motion import Skeleton
from studio.motion.avatar import Avatar
from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES, VRM0_TO_VRM1
from studio.motion.expression import NOTHING, key
from studio.render.camera import Orbit
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.widgets.card import label
from studio.ui.widgets.figure.figure import StickFigure

CLOSE_UP = Orbit(azimuth=-10.0, elevation=2.0, zoom=0.27)
WARM_UP_MS = 50
_SPELT = {key(name): name for name in (*ARKIT_SHAPES, *VRM0_SHAPES)}
_INDEX = Qt.ItemDataRole.UserRole


class FaceDialog(QDialog):
    """A list of the avatar's faces beside a picture of the one that is chosen.

    Args:
        avatar: whose.
        parent: the window.

    Signals:
        drivers_changed: other blend shapes move its faces; carries all that is not as its names have it.
    """

    drivers_changed = Signal(object)

    def __init__(self, avatar: Avatar, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("face_dialog")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle(_tr("Face shapes of {0}").format(avatar.name))
        self.resize(860, 560)
        self._avatar = avatar
        self._by_names = avatar.driven_by({})
        self.figure = StickFigure(empty_text=_tr("The avatar appears in a moment."))
        self.figure.view_buttons_shown = False
        self.figure.set_orbit(CLOSE_UP)
        self.list = self._build_list()
        self.attempt = QSlider(Qt.Orientation.Horizontal)
        self.attempt.setObjectName("face_try")
        self.attempt.setRange(0, 100)
        self.attempt.setAccessibleName(_tr("Try"))
        self.attempt.setToolTip(_tr("Move the chosen face, here only"))
        self.attempt.valueChanged.connect(lambda _: self._show_face())
        self.driver = self._build_driver()
        self.reset = QPushButton(_tr("Reset all"))
        self.reset.setObjectName("face_reset")
        self.reset.setToolTip(_tr("Let the names decide again what moves each face"))
        self.reset.clicked.connect(self._on_reset)
        self._lay_out()
        # Each face by a channel of its own: what is tried is the one, whatever drives it.
        own = {one.name: f"#{i}" for i, one in enumerate(avatar.expressions)}
        self.figure.set_avatar(avatar.driven_by(own))
        self._show_rows()
        self.list.setCurrentIndex(self.list.model().index(0, 0))
        QTimer.singleShot(WARM_UP_MS, self.figure, self.figure.warm_up)

    @property
    def skeleton(self) -> Skeleton:
        """By which its avatar is known: it stays the same whatever moves the faces."""
        return self._avatar.skeleton

    def done(self, result: int) -> None:
        """Free the picture before the window goes."""
        self.figure.dispose()
        super().done(result)

    def _build_list(self) -> QTreeWidget:
        made = QTreeWidget()
        made.setObjectName("face_list")
        made.setHeaderLabels([_tr("Face"), _tr("Moved by")])
        made.setRootIsDecorated(False)
        made.setUniformRowHeights(True)
        made.setColumnWidth(0, 190)
        for i, one in enumerate(self._avatar.expressions):
            item = QTreeWidgetItem([one.name, ""])
            item.setData(0, _INDEX, i)
            if not one.moves:
                item.setToolTip(0, _tr("Nothing in the avatar's file belongs to it"))
                item.setForeground(0, theme.colour("muted"))
            made.addTopLevelItem(item)
        made.currentItemChanged.connect(lambda *_: self._on_chosen())
        return made

    def _build_driver(self) -> QComboBox:
        made = QComboBox()
        made.setObjectName("face_driver")
        made.setAccessibleName(_tr("Moved by"))
        made.setToolTip(_tr("The blend shape, of your tracker or your run, that moves this face"))
        # Rigs have names of their own: they may be typed.
        made.setEditable(True)
        made.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        completer = made.completer()
        assert completer is not None
        completer.setFilterMode(Qt.MatchFlag.MatchContains)
        completer.setCompletionMode(QCompleter.CompletionMode.PopupCompletion)
        made.activated.connect(lambda _: self._on_driver())
        edit = made.lineEdit()
        assert edit is not None
        edit.editingFinished.connect(self._on_driver)
        return made

    def _lay_out(self) -> None:
        words = _tr("Click a face to see it. If the wrong shape moves it, choose another below.")
        side = QVBoxLayout()
        side.setSpacing(theme.INSIDE)
        side.addWidget(self.figure, 1)
        for text, control in ((_tr("Try"), self.attempt), (_tr("Moved by"), self.driver)):
            row, title = QHBoxLayout(), label(text, "muted")
            title.setMinimumWidth(80)
            title.setBuddy(control)
            row.addWidget(title)
            row.addWidget(control, 1)
            side.addLayout(row)
        both = QHBoxLayout()
        both.setSpacing(theme.BETWEEN)
        both.addWidget(self.list, 1)
        both.addLayout(side, 1)
        close = QPushButton(_tr("Close"))
        close.setAutoDefault(False)
        self.reset.setAutoDefault(False)
        close.clicked.connect(self.accept)
        below = QHBoxLayout()
        below.addWidget(self.reset)
        below.addStretch(1)
        below.addWidget(close)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.EDGE, theme.BETWEEN, theme.EDGE, theme.BETWEEN)
        column.setSpacing(theme.BETWEEN)
        fitted = _tr(
            "Takes without its vowels or blinks are fitted: jaw and lips open the mouth, lids blink."
        )
        column.addWidget(label(words))
        column.addWidget(label(fitted, "muted"))
        column.addLayout(both, 1)
        column.addLayout(below)

    @property
    def _chosen(self) -> int:
        item = self.list.currentItem()
        return int(item.data(0, _INDEX)) if item is not None else -1

    def _show_rows(self) -> None:
        """What moves each face, one that a person chose in the accent's colour."""
        for i, one in enumerate(self._avatar.expressions):
            item = self.list.topLevelItem(i)
            assert item is not None
            own = one.name in self._avatar.drivers
            name = spelt(self._avatar.drivers[one.name] if own else self._by_names.face.driver(i))
            item.setText(1, _tr("{0} (yours)").format(name) if own else name)
            item.setForeground(1, theme.colour("accent" if own else "text" if one.moves else "muted"))
        self.reset.setEnabled(bool(self._avatar.drivers))

    def _on_chosen(self) -> None:
        i = self._chosen
        if i < 0:
            return
        one = self._avatar.expressions[i]
        with QSignalBlocker(self.driver):
            self.driver.clear()
            self.driver.addItem(self._automatic(i), None)
            self.driver.addItem(_tr("Nothing"), NOTHING)
            for name in (*VRM0_SHAPES, *ARKIT_SHAPES):
                self.driver.addItem(spelt(key(name)), name)
            known = self._avatar.drivers.get(one.name)
            place = 0 if known is None else self.driver.findData(known)
            self.driver.setCurrentIndex(place)
            if place < 0:
                self.driver.setEditText(known or "")
        with QSignalBlocker(self.attempt):
            self.attempt.setValue(100)
        self._show_face()

    def _automatic(self, i: int) -> str:
        return _tr("By its name: {0}").format(spelt(self._by_names.face.driver(i)))

    def _show_face(self) -> None:
        rest = WorldPose.rest_pose(self._avatar.skeleton)
        self.figure.show_stance(replace(rest, shapes={f"#{self._chosen}": self.attempt.value() / 100}))

    def _on_driver(self) -> None:
        i, text = self._chosen, self.driver.currentText().strip()
        if i < 0:
            return
        name = self._avatar.expressions[i].name
        place = self.driver.findText(text, Qt.MatchFlag.MatchFixedString)
        chosen = self.driver.itemData(place) if place >= 0 else text
        # An empty field is no choice.
        chosen = None if not text else chosen
        if chosen == self._avatar.drivers.get(name):
            return
        drivers = dict(self._avatar.drivers)
        drivers.pop(name, None)
        self._change(drivers if chosen is None else {**drivers, name: str(chosen)})

    def _on_reset(self) -> None:
        self._change({})
        self._on_chosen()

    def _change(self, drivers: dict[str, str]) -> None:
        self._avatar = self._avatar.driven_by(drivers)
        self._show_rows()
        self.drivers_changed.emit(drivers)


def spelt(driver: str) -> str:
    """What people call a blend shape, by its `key` or its own name."""
    if driver == NOTHING:
        return _tr("Nothing")
    name = _SPELT.get(key(driver), driver)
    new = VRM0_TO_VRM1.get(name, name)
    return name if key(name) == new.lower() else f"{name} / {new}"


def _tr(text: str) -> str:
    return QCoreApplication.translate("FaceDialog", text)
