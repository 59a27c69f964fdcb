"""Presenter of the avatar window: opens it from Live, moves its avatar, and remembers how it stood."""

from __future__ import annotations

import time

from PySide6.QtCore import QObject, QRect, QSignalBlocker, QTimer

from studio.ipc.events import PoseEvent
from studio.motion import Skeleton
from studio.render.world_pose import WorldPose
from studio.ui import messages
from studio.ui.live.avatar_window import AvatarWindow, place_of, text_of
from studio.ui.live.model import LiveModel
from studio.ui.live.stream_view import StreamCard
from studio.ui.session import Session
from studio.ui.view_settings import ViewSettings


class AvatarWindowPresenter(QObject):
    """There is a window only while it is open: its avatar is drawn a second time.

    Attributes:
        window: None while it is closed.
    """

    def __init__(self, card: StreamCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self.window: AvatarWindow | None = None
        self._seen: ViewSettings | None = None
        card.window_switched.connect(self._on_switched)
        model.posed.connect(self._on_pose)
        model.ended.connect(self._show_rest)
        session.avatars.changed.connect(self._show_avatar)
        session.settings_changed.connect(self._on_settings)

    def close(self) -> None:
        """The main window closes."""
        if self.window is not None:
            self.window.close()

    def _on_switched(self, on: bool) -> None:
        if on and self.window is None:
            self._open()
        elif not on:
            self.close()

    def _open(self) -> None:
        settings = self._session.settings
        window = self.window = AvatarWindow(settings.window_on_top)
        self._seen = ViewSettings(
            window, (window.pane,), window.backgrounds, self._session, "window_camera", "window_background"
        )
        window.stand(place_of(settings.window_place))
        window.placed.connect(self._on_placed)
        window.on_top_chosen.connect(lambda on: self._session.change_settings(window_on_top=on))
        window.closed.connect(self._on_closed)
        window.figure.avatar_too_slow.connect(self._on_too_slow)
        self._show_avatar()
        self._model.set_window(True)
        window.show()
        # Seen first, drawn by OpenGL then: its first picture takes a moment.
        QTimer.singleShot(0, window, window.figure.warm_up)

    def _on_closed(self) -> None:
        if self._seen is not None:
            self._seen.close()
        self._model.set_window(False)
        window, self.window, self._seen = self.window, None, None
        if window is not None:
            window.figure.dispose()
            window.deleteLater()
        with QSignalBlocker(self._card.avatar_window):
            self._card.avatar_window.setChecked(False)

    def _on_too_slow(self) -> None:
        what = self.tr(
            "This computer was too busy to draw the avatar window: it is coarser until that is over."
        )
        # In the main window: what stands in the avatar's own, viewers read.
        messages.show_warning(self._card, what, self.tr("If it stays coarse, choose a simpler avatar."))

    def _on_placed(self, place: QRect) -> None:
        if text_of(place) != self._session.settings.window_place:
            self._session.change_settings(window_place=text_of(place))

    def _on_settings(self, changed: frozenset[str]) -> None:
        if self.window is not None and "window_on_top" in changed:
            self.window.set_on_top(self._session.settings.window_on_top)

    def _show_avatar(self) -> None:
        if self.window is not None:
            self.window.pane.set_avatar(self._session.avatars.avatar)
            if self._model.state is None:
                self._show_rest()

    def _show_rest(self) -> None:
        """Nothing is live: it stands with its arms down."""
        if self.window is not None:
            avatar = self.window.figure.avatar
            skeleton = avatar.skeleton if avatar is not None else Skeleton.humanoid()
            self.window.show_stance(WorldPose.rest_pose(skeleton))

    def _on_pose(self, event: PoseEvent) -> None:
        ready = self._model.ready
        stance = ready.stance(event, time.monotonic()) if self.window is not None and ready else None
        if self.window is not None and stance is not None:
            self.window.show_stance(stance)
