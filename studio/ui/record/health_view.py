"""The health card: in words a performer understands, each with what to do."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import Card, Picture, label

SHOWN = 4


class HealthRow(QWidget):
    """A symbol, a sentence, and a remedy."""

    def __init__(self) -> None:
        super().__init__()
        self._shown = ("", "", "")
        self._picture = Picture("mdi6.check-circle", 16, "good")
        self._what = label()
        self._remedy = label("", "caption")
        for text in (self._what, self._remedy):
            text.setWordWrap(True)
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addWidget(self._what)
        words.addWidget(self._remedy)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._picture, 0, Qt.AlignmentFlag.AlignTop)
        row.addLayout(words, 1)

    def show_finding(self, what: str, remedy: str, health: str) -> None:
        """Show a finding; nothing is done where it is shown already."""
        if (what, remedy, health) == self._shown:
            return
        self._shown = (what, remedy, health)
        icons = {"good": "mdi6.check-circle", "warn": "mdi6.alert", "": "mdi6.circle-outline"}
        self._picture.set_icon(icons[health], health or "disabled")
        self._what.setText(what)
        self._remedy.setText(remedy)
        self._remedy.setVisible(bool(remedy))
        theme.as_role(self._what, "" if health == "warn" else "muted")


class HealthCard(Card):
    """Findings, and the numbers behind them."""

    def __init__(self) -> None:
        super().__init__(self.tr("Health"))
        self.setAccessibleName(self.tr("Health of the inputs"))
        self._rows = [HealthRow() for _ in range(SHOWN)]
        for row in self._rows:
            row.hide()
            self.body.addWidget(row)
        self.body.addStretch(1)
        self._numbers: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(2)
        titles = (
            ("packets", self.tr("Packets/s")), ("frames", self.tr("Frames/s")),
            ("jitter", self.tr("Jitter")), ("late", self.tr("Pauses")),
            ("lost", self.tr("Lost")), ("bad", self.tr("Refused")),
        )  # fmt: skip
        for place, (key, title) in enumerate(titles):
            line, column = divmod(place, 2)
            number = label("–", "", f"health_{key}")
            number.setFont(theme.figures_font())
            number.setAlignment(Qt.AlignmentFlag.AlignRight)
            number.setAccessibleName(title)
            caption = label(title, "caption")
            for part in (caption, number):
                part.setToolTip(self._told()[key])
            grid.addWidget(caption, line, column * 3)
            grid.addWidget(number, line, column * 3 + 1)
            grid.setColumnStretch(column * 3 + 1, 1)
            self._numbers[key] = number
        grid.setColumnMinimumWidth(2, 16)
        self.body.addLayout(grid)

    def _told(self) -> dict[str, str]:
        """What each number means and what is good."""
        return {
            "packets": self.tr("Network packets of the tracker in a second; only 0 is bad"),
            "frames": self.tr("Poses of the tracker in a second; 30 and more are good, 60 are better"),
            "jitter": self.tr(
                "How unevenly poses come in, milliseconds; below 10 is good, takes are evened out"
            ),
            "late": self.tr("How often the tracker paused; 0 is good"),
            "lost": self.tr("Poses and packets that never came in; 0 is good"),
            "bad": self.tr("Packets that were no motion and were refused; 0 is good"),
        }

    def show_findings(self, findings: list[tuple[str, str, str]]) -> None:
        """Show (what, remedy, health) rows, the worst first."""
        for row, finding in zip(self._rows, findings, strict=False):
            row.show_finding(*finding)
            row.show()
        for row in self._rows[len(findings) :]:
            row.hide()

    def show_numbers(self, **numbers: str) -> None:
        """Show packets, frames, jitter, late, lost, bad."""
        for key, text in numbers.items():
            self._numbers[key].setText(text)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The findings in sight."""
        return tuple(row._shown[0] for row in self._rows if not row.isHidden())
