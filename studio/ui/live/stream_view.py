"""On stream: other programs that press Live's keys, OBS, and the last minutes kept as a take."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QMenu, QPushButton, QToolButton

from studio.remote.server import ACTIONS, ROOT, url_of
from studio.ui import theme
from studio.ui.live.obs_view import ObsPanel
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.widgets.card import Card, label


class StreamCard(Card):
    """The card's layout.

    Signals:
        remote_switched: whether other programs may press Live's keys.
        copy_requested: an address, to the clipboard.
        keep_requested: the last minutes are to be kept.
        window_switched: whether the avatar is to have a window of its own.
    """

    remote_switched = Signal(bool)
    copy_requested = Signal(str)
    keep_requested = Signal()
    window_switched = Signal(bool)

    def __init__(self) -> None:
        super().__init__(self.tr("On stream"))
        self.remote = QCheckBox(self.tr("Stream Deck and other remotes"))
        self.remote.setObjectName("live_remote")
        self.remote.toggled.connect(self.remote_switched)
        self.addresses = QToolButton()
        self.addresses.setObjectName("live_remote_addresses")
        self.addresses.setText(self.tr("Addresses"))
        self.addresses.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        theme.as_role(self.addresses, "chip")
        self._menu = QMenu(self.addresses)
        self.addresses.setMenu(self._menu)
        self.words = label("", "caption", "live_remote_words")
        self.words.setWordWrap(True)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.words, 1)
        row.addWidget(self.addresses, 0, Qt.AlignmentFlag.AlignTop)
        self.avatar_window = QPushButton(name_of("avatar_window"))
        self.avatar_window.setObjectName("live_avatar_window")
        self.avatar_window.setToolTip(tip_of("avatar_window"))
        self.avatar_window.setCheckable(True)
        theme.set_icon(self.avatar_window, "mdi6.dock-window", "muted", "accent")
        self.avatar_window.toggled.connect(self.window_switched)
        self.keep = QPushButton(name_of("keep_live"))
        self.keep.setObjectName("live_keep")
        self.keep.setToolTip(tip_of("keep_live"))
        theme.set_icon(self.keep, "mdi6.history", "muted")
        self.keep.clicked.connect(self.keep_requested)
        self.obs = ObsPanel()
        self.body.addWidget(self.avatar_window)
        self.body.addWidget(self.keep)
        self.body.addWidget(self.obs)
        self.body.addWidget(self.remote)
        self.body.addLayout(row)
        self.show_live(False)

    def show_live(self, live: bool) -> None:
        """Enable what needs a performance."""
        self.keep.setEnabled(live)

    def show_remote(self, on: bool, port: int, problem: str = "") -> None:
        """Show whether other programs may press Live's keys, the addresses, and why they cannot."""
        with QSignalBlocker(self.remote):
            self.remote.setChecked(on)
        self.addresses.setVisible(on and not problem)
        theme.as_role(self.words, "warn" if problem else "caption")
        self.words.setText(problem or self._words(on))
        self.remote.setToolTip(
            self.tr(
                "Presses Live's keys while another program is in front.\n"
                "Stream Deck: add System > Website, paste {0} and tick GET request in background.\n"
                "Touch Portal: add an HTTP GET action with the same address.\n"
                "OSC: send {1} to 127.0.0.1, port {2}.\n"
                "No remote? Give a keyboard shortcut of your system the command: curl {0}\n"
                "Only programs on this computer reach it; web pages do not."
            ).format(url_of("mute", port), f"{ROOT}/mute", port)
        )
        self._menu.clear()
        for name, action in ACTIONS.items():
            url = url_of(name, port)
            title = name_of(action).format(name.rpartition("/")[2])
            self._menu.addAction(f"{title}\t{url}").triggered.connect(partial(self.copy_requested.emit, url))

    def _words(self, on: bool) -> str:
        if on:
            return self.tr("Choose an address to copy it, then paste it into a button of your remote.")
        return self.tr("Keys such as M work only while this window is in front. On stream, use a remote.")
