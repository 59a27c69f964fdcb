"""How a performer is seen, camera and background: kept in the settings from one time to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from PySide6.QtCore import QObject, QTimer, SignalInstance
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.render.background import ROOM, Background
from studio.render.camera import CLOSEST, FARTHEST, Orbit
from studio.ui import messages, tasks

if TYPE_CHECKING:
    from studio.ui.session import Session

KEEP_MS = 500
"""A camera that is turned is kept once it rests."""


class FigureCamera(Protocol):
    """What looks at a performer."""

    orbit: Orbit

    @property
    def view_changed(self) -> SignalInstance:
        """It moved; carries an Orbit."""

    def set_orbit(self, orbit: Orbit) -> None:
        """Look from somewhere."""


class SeenPerformer(Protocol):
    """A picture of a performer."""

    @property
    def figure(self) -> FigureCamera:
        """What its camera belongs to."""

    def set_background(self, background: Background) -> None:
        """What is behind the performer."""


class BackgroundChooser(Protocol):
    """A menu or button of backgrounds."""

    @property
    def chosen(self) -> SignalInstance:
        """Carries a background's text."""

    def show_background(self, background: Background) -> None:
        """Tick one."""


class ViewSettings(QObject):
    """Presenter of a picture's camera and background.

    Args:
        widget: where to say that an image cannot be read.
        panes: pictures of one camera.
        chooser: what chooses their background.
        session: the settings.
        camera, background: names of the settings.
    """

    def __init__(
        self,
        widget: QWidget,
        panes: Sequence[SeenPerformer],
        chooser: BackgroundChooser,
        session: Session,
        camera: str,
        background: str = "stage_background",
    ) -> None:
        super().__init__(widget)
        self._widget, self._panes, self._chooser, self._session = widget, panes, chooser, session
        self._looking = panes[0].figure
        self._camera, self._background = camera, background
        self._opening, self._showing = tasks.LatestTask(self), tasks.LatestTask(self)
        self._keep = QTimer(self)
        self._keep.setSingleShot(True)
        self._keep.setInterval(KEEP_MS)
        self._keep.timeout.connect(self.keep)
        kept = orbit_of(str(getattr(session.settings, camera)))
        if kept is not None:
            self._looking.set_orbit(kept)
        self._looking.view_changed.connect(lambda _: self._keep.start())
        chooser.chosen.connect(self._on_chosen)
        session.settings_changed.connect(self._on_settings)
        self._show()

    @property
    def background(self) -> Background:
        """What is behind the performer."""
        return Background(str(getattr(self._session.settings, self._background)) or ROOM.text)

    def keep(self) -> None:
        """Keep the camera now."""
        self._keep.stop()
        orbit = self._looking.orbit
        text = f"{orbit.azimuth:.2f},{orbit.elevation:.2f},{orbit.zoom:.3f}"
        if text != getattr(self._session.settings, self._camera):
            self._session.change_settings(**{self._camera: text})

    def close(self) -> None:
        """The window closes: a camera that was just turned is kept, too."""
        if self._keep.isActive():
            self.keep()

    def _on_settings(self, changed: frozenset[str]) -> None:
        if self._background in changed:
            self._show()

    def _on_chosen(self, text: str) -> None:
        self._opening.drop()
        try:
            background = Background.parse(text)
        except StudioError as error:
            self._refuse(error)
            return
        if not background.is_image:
            self._choose(background)
            return
        self._chooser.show_background(background)
        # An image that cannot be read is refused here, and not in each picture.
        self._opening.run(background.load, lambda _: self._choose(background), self._refuse)

    def _choose(self, background: Background) -> None:
        self._session.change_settings(**{self._background: background.text})

    def _refuse(self, error: BaseException) -> None:
        self._chooser.show_background(self.background)
        messages.show_error(self._widget, error)

    def _show(self) -> None:
        background = self.background
        self._chooser.show_background(background)
        self._showing.drop()
        if background.is_image:
            # Read before it is painted; one that cannot be read any more is the room.
            self._showing.run(
                background.load, lambda _: self._set(background), lambda _error: self._set(ROOM)
            )
        else:
            self._set(background)

    def _set(self, background: Background) -> None:
        for pane in self._panes:
            pane.set_background(background)


def orbit_of(text: str) -> Orbit | None:
    """A camera as settings have it, "azimuth,elevation,zoom"; None where it is none."""
    try:
        azimuth, elevation, zoom = (float(part) for part in text.split(","))
    except ValueError:
        return None
    possible = abs(azimuth) <= 180.0 and -15.0 <= elevation <= 80.0 and CLOSEST <= zoom <= FARTHEST
    return Orbit(azimuth, elevation, zoom) if possible else None
