"""What the Review tab does: loads, generates, tunes, and keeps playing, sending and exporting in step."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from studio.errors import StudioError
from studio.motion import Pose
from studio.training.run_choice import RunSelection
from studio.ui import messages, tasks
from studio.ui.avatar_store import Avatars
from studio.ui.review import clip
from studio.ui.review.batching import BatchPresenter
from studio.ui.review.clip import ReviewClip, ReviewItem
from studio.ui.review.exporting import ExportInput, ExportPresenter
from studio.ui.review.listing import ReviewList
from studio.ui.review.making import GenerationPresenter
from studio.ui.review.playing import TransportPresenter
from studio.ui.review.scene import A, B, ReviewScene
from studio.ui.review.sending import SendPresenter
from studio.ui.review.showing import StagePresenter
from studio.ui.review.tunings import TuningPresetPresenter
from studio.ui.review.view import ReviewView
from studio.ui.review.voting import VotePresenter
from studio.ui.session import Session
from studio.ui.undo import JointUndo
from studio.vmc.sender import PoseSource

LOADING_MS = 250
"""What is loaded sooner is not announced: the figure before it would only flicker."""


class ReviewPresenter(QObject):
    """Thought of the Review tab. Loading and tuning run on the pool, generating in a child process."""

    def __init__(self, view: ReviewView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        self.scene = ReviewScene()
        self._active = False
        self._requested_run = ""
        self._loading = tasks.LatestTask(self)  # newest request wins
        self._slow = QTimer(self)
        self._slow.setSingleShot(True)
        self._slow.timeout.connect(self._say_loading)
        self._listing = ReviewList(view.sources_card, session)
        self._showing = StagePresenter(view, self.scene)
        self._playing = TransportPresenter(view, self.scene, self._showing)
        self._making = GenerationPresenter(view, self.scene, self._listing, session)
        self._voting = VotePresenter(view.bar, self.scene, lambda: session.project, self._show_motion)
        self._sending = SendPresenter(view.send, session, self._pose_source)
        self._tunings = TuningPresetPresenter(view.tune, session)
        self._tune_undo = view.tune.undo_scope
        self.undo_scope = JointUndo((self._tune_undo, self._tunings.steps, self._listing.steps), self)
        self._avatars = Avatars(view.stage, session)
        self._exporting = ExportPresenter(view.export, self._exhibit, session)
        self._batching = BatchPresenter(view, self._listing, session, lambda: view.tune.tuning)
        self._connect()
        self._on_project()

    def activate(self) -> None:
        """The tab is shown."""
        self._active = True
        wanted, self._requested_run = self._requested_run, ""
        if not wanted and not self.scene.sides[A].wanted.run and not self._making.captured_only:
            wanted = self._listing.newest_run()
        before = self.scene.source
        if wanted and wanted != self.scene.sides[A].wanted.run:
            self.scene.sides[A].wanted = RunSelection(wanted)
        self._show_lists()
        if wanted and before is not None and self.scene.source is before:
            self._making.ask(A)
        self._playing.activate()
        QTimer.singleShot(300, self, self._warm_up)

    def show_run(self, run: str) -> None:
        """Show a run; where the tab is not shown, once it is."""
        self._requested_run = run
        if self._active:
            self.activate()

    def deactivate(self) -> None:
        """Another tab is shown; sending goes on, the sound rests."""
        self._active = False
        self._playing.deactivate()

    def close(self) -> None:
        """The window closes."""
        self._playing.close()
        self._making.close()
        self._sending.close()
        self._exporting.close()
        self._batching.close()
        if self.scene.player is not None:
            self.scene.player.close()
        self._view.stage.dispose()

    def add_sounds(self, paths: list[Path]) -> None:
        """Keep sounds in the project and show the first."""
        self._listing.add(paths)

    def _connect(self) -> None:
        view, session, bar = self._view, self._session, self._view.bar
        view.sources_card.chosen.connect(self._on_source)
        self._listing.changed.connect(self._show_lists)
        self._listing.wanted.connect(self._on_source)
        self._listing.going.connect(self._on_going)
        self._making.changed.connect(self._show_motion)
        self._making.spoilt.connect(self._voting.end)
        bar.ghost_toggled.connect(lambda _: self._showing.show_layout())
        bar.view_requested.connect(view.stage.set_view)
        view.curve_chosen.connect(lambda _: self._showing.show_curves())
        view.train_requested.connect(lambda: session.tab_requested.emit("train"))
        view.record_requested.connect(lambda: session.tab_requested.emit("record"))
        self._tune_undo.stepped.connect(lambda: view.tabs.setCurrentWidget(view.tune))
        session.project_opened.connect(self._on_project)
        session.takes_changed.connect(self._show_lists)
        session.runs_changed.connect(self._show_lists)
        session.sounds_dropped.connect(lambda paths: self.add_sounds(list(paths)))

    # -- lists -------------------------------------------------------------------------------------

    def _on_project(self) -> None:
        self._making.captured_only = False
        for side in self.scene.sides:
            side.wanted = RunSelection()
        self.scene.two = False
        self._view.bar.show_two(False)
        self._listing.open()
        self._forget()
        self._show_lists()

    def _show_lists(self) -> None:
        """Bring sources and runs up to date, while they are seen; a thousand takes cost time."""
        if self._session.project is not None and not self._active:
            return
        scene, listing = self.scene, self._listing
        listing.refresh()
        self._view.show_empty(not listing.sources)
        if scene.source is not None:
            found = listing.find(scene.source.key)
            if found is None:
                self._forget()
            elif found.stands_for != scene.source.stands_for:  # trimmed, moved or cleaned in Curate
                self._choose(found)
                return
        listing.show(scene.source)
        self._making.show_runs()
        first = listing.first()
        if scene.source is None and first is not None:
            self._choose(first)

    def _on_going(self, key: str) -> None:
        """A sound's file is about to go: let go of it."""
        if self.scene.source is not None and self.scene.source.key == key:
            self._forget()

    # -- what is on the stage ----------------------------------------------------------------------

    def _on_source(self, key: str) -> None:
        source, before = self._listing.find(key), self.scene.source
        if source is not None and (before is None or source.key != before.key):
            self._choose(source)

    def _choose(self, source: ReviewItem) -> None:
        project = self._session.project
        if project is None:
            return
        self._forget()
        self.scene.source = source
        self._show_lists()
        stage = self._view.stage
        if stage.predicted.figure.empty and stage.captured.figure.empty:
            self._say_loading()
        else:
            self._slow.start(LOADING_MS)
        device = self._session.settings.audio_output or None

        def failed(error: BaseException) -> None:
            self._slow.stop()
            self._on_load_error(source, error)

        self._loading.run(
            lambda: clip.load(source, device), self._show_loaded, failed, lambda found: found.player.close()
        )

    def _say_loading(self) -> None:
        if self.scene.source is not None:
            self._showing.show_loading(self.scene.source.title)

    def _on_load_error(self, source: ReviewItem, error: BaseException) -> None:
        """Say what is wrong; a dropped sound that cannot be read is of no use in the list."""
        sentence = error.what if isinstance(error, StudioError) else str(error)
        self._view.stage.predicted.show_nothing(sentence, "mdi6.alert-outline")
        if source.take is None and isinstance(error, StudioError):
            self._listing.remove(source.key, why=error.what)
        else:
            messages.show_error(self._view, error)

    def _show_loaded(self, loaded: ReviewClip) -> None:
        scene = self.scene
        scene.captured, scene.player = loaded.captured, loaded.player
        if scene.source is not None and self._listing.note_duration(scene.source, loaded.player.duration):
            self._show_lists()
        timeline = self._view.timeline
        timeline.set_duration(loaded.player.duration)
        timeline.set_sound(loaded.peaks)
        start, end = scene.used
        outside = [span for span in ((0.0, start), (end, loaded.player.duration)) if span[1] - span[0] > 0.01]
        timeline.set_excluded(outside)
        self._playing.begin()
        self._making.ask(A, B)

    def _forget(self) -> None:
        """Clear the stage."""
        self._voting.end()
        self._making.forget()
        self._loading.drop()
        self.scene.clear()
        self._showing.clear()

    def _show_motion(self) -> None:
        """Bring everything that shows, sends or exports the motion up to the scene."""
        scene, view, project = self.scene, self._view, self._session.project
        self._slow.stop()
        self._showing.busy = self._making.busy
        view.bar.show_front(scene.front, scene.both_ready)
        self._showing.show_motion()
        self._sending.refresh()
        main = scene.tuned
        folder = project.exports_folder if project else None
        body = main is not None and bool(main.bone_names)
        view.export.show_target(scene.name, folder, scene.whole, body)
        view.export.show_what(scene.predicted is not None)

    def _warm_up(self) -> None:
        if self._active and not self._session.rolling:
            self._view.stage.warm_up()

    # -- for sending and exporting -----------------------------------------------------------------

    def _pose_source(self) -> PoseSource | None:
        motion, player = self.scene.tuned, self.scene.player
        if motion is None or player is None or not len(motion):
            return None

        def pose_at(t: float) -> Pose:
            return motion.pose(t)

        return PoseSource(motion.shape_names, motion.bone_names, pose_at, lambda: player.position)

    def _exhibit(self) -> ExportInput | None:
        scene = self.scene
        if scene.tuned is None or not scene.whole or scene.source is None or scene.player is None:
            return None
        start, end = scene.used
        whole = start <= 0.0 and end >= scene.player.duration - 1e-3
        untuned = scene.predicted if scene.predicted is not None else scene.captured.motion
        orbit = self._view.stage.predicted.figure.orbit
        return ExportInput(
            scene.name,
            scene.tuned,
            untuned if untuned is not None else scene.tuned,
            scene.source.sound,
            start,
            end,
            whole,
            self._playing.span,
            scene.player.position,
            (orbit.azimuth, orbit.elevation, orbit.zoom),
            self._avatars.worn,
        )
