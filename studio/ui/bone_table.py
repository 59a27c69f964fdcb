"""Which joint of an imported skeleton is which bone: what was guessed, put right by a person in a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QHeaderView,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.errors import StudioError
from studio.ipc.events import BonesEvent
from studio.ui import messages, theme
from studio.ui.session import Session
from studio.ui.widgets.card import label

if TYPE_CHECKING:
    from studio.take.take import Take

NEEDED = "Hips"


class BoneDialog(QDialog):
    """One row a joint; not modal, so that nothing else has to wait.

    Signals:
        table_accepted: bone by joint, both by name; "" is no bone.
    """

    table_accepted = Signal(object)

    def __init__(self, name: str, pairs: Sequence[tuple[str, str]], parent: QWidget | None = None) -> None:
        """`pairs` are (joint, the bone it was taken for or "") in the file's order."""
        super().__init__(parent)
        self.setObjectName("bone_dialog")
        self.setWindowTitle(self.tr("Bones of {0}").format(name))
        self.resize(560, 620)
        self._guess = tuple(pairs)
        self._boxes: list[_BoneBox] = []
        self._problem = label("", "caption", "bone_problem")
        self._problem.setWordWrap(True)
        sentence = self.tr(
            "Joints were matched to bones by name. Correct any mistakes; the project remembers them "
            "for every skeleton with these joints."
        )
        words = label(sentence, "muted")
        words.setWordWrap(True)
        column = QVBoxLayout(self)
        column.setSpacing(theme.INSIDE)
        column.addWidget(words)
        column.addWidget(self._build_table(), 1)
        column.addWidget(self._problem)
        column.addWidget(self._build_buttons())
        self._check()

    @property
    def chosen(self) -> dict[str, str]:
        """Bone by joint as the table says now."""
        return {joint: box.bone for (joint, _), box in zip(self._guess, self._boxes, strict=True)}

    def choose(self, joint: str, bone: str) -> None:
        """Say that a joint is a bone, "" for none."""
        place = [name for name, _ in self._guess].index(joint)
        self._boxes[place].set_bone(bone)

    def _build_table(self) -> QTableWidget:
        table = QTableWidget(len(self._guess), 2)
        table.setObjectName("bone_table")
        table.setAccessibleName(self.tr("Joints and bones"))
        table.setHorizontalHeaderLabels([self.tr("Joint in the file"), self.tr("Bone")])
        table.verticalHeader().hide()
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        header = table.horizontalHeader()
        for column in (0, 1):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Stretch)
        for row, (joint, bone) in enumerate(self._guess):
            item = QTableWidgetItem(joint)
            item.setFlags(Qt.ItemFlag.ItemIsEnabled)
            table.setItem(row, 0, item)
            box = _BoneBox(self.tr("no bone"))
            box.setObjectName(f"bone_{row}")
            box.setAccessibleName(self.tr("Bone of {0}").format(joint))
            box.set_bone(bone)
            box.currentIndexChanged.connect(self._check)
            table.setCellWidget(row, 1, box)
            self._boxes.append(box)
        table.verticalHeader().setDefaultSectionSize(36)
        return table

    def _build_buttons(self) -> QDialogButtonBox:
        buttons = QDialogButtonBox()
        self._accept = QPushButton(self.tr("Import again with these bones"))
        self._accept.setObjectName("bone_accept")
        theme.as_role(self._accept, "primary")
        reset = QPushButton(self.tr("Reset to automatic"))
        reset.setObjectName("bone_reset")
        buttons.addButton(self._accept, QDialogButtonBox.ButtonRole.AcceptRole)
        buttons.addButton(reset, QDialogButtonBox.ButtonRole.ResetRole)
        cancel = buttons.addButton(self.tr("Cancel"), QDialogButtonBox.ButtonRole.RejectRole)
        cancel.setObjectName("bone_cancel")
        buttons.accepted.connect(self._on_accept)
        buttons.rejected.connect(self.reject)
        reset.clicked.connect(self._on_reset)
        return buttons

    def _check(self) -> None:
        """Say what is wrong with the table; with nothing wrong it can be used."""
        given: dict[str, list[str]] = {}
        for joint, bone in self.chosen.items():
            if bone:
                given.setdefault(bone, []).append(joint)
        twice = next(((bone, joints) for bone, joints in given.items() if len(joints) > 1), None)
        problem = ""
        if twice:
            sentence = self.tr("{0} is assigned to both {1} and {2}. Choose one.")
            problem = sentence.format(twice[0], *twice[1][:2])
        elif NEEDED not in given:
            problem = self.tr("Choose which joint is the hips: every other bone depends on it.")
        elif len(given) < 2:
            problem = self.tr("Assign at least one bone besides the hips.")
        counted = self.tr("{0} of {1} joints are bones.").format(len(given), len(self._guess))
        self._problem.setText(problem or counted)
        theme.as_role(self._problem, "warn" if problem else "caption")
        self._accept.setEnabled(not problem)

    def _on_reset(self) -> None:
        for (_, bone), box in zip(self._guess, self._boxes, strict=True):
            box.set_bone(bone)

    def _on_accept(self) -> None:
        self.table_accepted.emit(self.chosen)
        self.accept()


class _BoneBox(QComboBox):
    """The bones to choose from; the wheel scrolls the table and changes nothing."""

    def __init__(self, none: str) -> None:
        from studio.motion.channels import ALL_BONES  # not needed for the window to come up

        super().__init__()
        self.addItem(none, "")
        for bone in ALL_BONES:
            self.addItem(bone, bone)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    @property
    def bone(self) -> str:
        """The bone's name, "" for none."""
        return str(self.currentData())

    def set_bone(self, bone: str) -> None:
        """Choose a bone."""
        self.setCurrentIndex(max(self.findData(bone), 0))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Let the table scroll."""
        event.ignore()


@dataclass(frozen=True)
class ImportedSkeleton:
    """A file whose joints were matched to bones.

    Args:
        path: the file.
        pairs: (joint, the bone it was taken for or "") in the file's order.
        audio: the sound that belongs to it, None without.
        take: id of the take just made of it, which a new one shall replace; None to replace none.
    """

    path: Path
    pairs: tuple[tuple[str, str], ...]
    audio: Path | None = None
    take: str | None = None

    @classmethod
    def of_event(cls, event: BonesEvent) -> ImportedSkeleton:
        """What `saia import` tells of one."""
        audio = Path(event.audio) if event.audio else None
        return cls(Path(event.path), event.bones, audio, event.take or None)


class BoneTablePresenter(QObject):
    """Shows the table and does what it says."""

    def __init__(self, session: Session, window: QWidget) -> None:
        super().__init__(window)
        self._session, self._window = session, window
        self.dialog: BoneDialog | None = None

    def ask(self, skeleton: ImportedSkeleton) -> None:
        """Let the person correct which joint is which bone."""
        if self.dialog is not None:
            self.dialog.close()
        made = self.dialog = BoneDialog(skeleton.path.name, skeleton.pairs, self._window.window())
        made.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        made.table_accepted.connect(lambda table: self._use(skeleton, table))
        made.finished.connect(lambda _: self._forget(made))
        made.show()

    def ask_of(self, take: Take) -> None:
        """Let the person correct a take imported before; its file is read again."""
        from studio.formats import bvh
        from studio.formats._bones import BONES_FROM, load_tables

        path, project = Path(take.info.extra.get(BONES_FROM, "")), self._session.project
        if project is None:
            return
        try:
            pairs = bvh.matched(path, load_tables(project.folder))
        except StudioError as error:
            messages.show_error(self._window, error)
        else:
            self.ask(ImportedSkeleton(path, pairs, take.audio_path))

    def _use(self, skeleton: ImportedSkeleton, table: dict[str, str]) -> None:
        from studio.formats._bones import keep_table

        project = self._session.project
        if project is None:
            return
        try:
            keep_table(project.folder, [joint for joint, _ in skeleton.pairs], table)
            if skeleton.take is not None and any(take.id == skeleton.take for take in project.takes):
                self._session.remove_take(skeleton.take)
        except StudioError as error:
            messages.show_error(self._window, error)
            return
        self._session.import_requested.emit(tuple(p for p in (skeleton.path, skeleton.audio) if p))

    def _forget(self, dialog: BoneDialog) -> None:
        if self.dialog is dialog:
            self.dialog = None
