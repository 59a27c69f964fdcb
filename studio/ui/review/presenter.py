"""What the Review tab does: loads, generates, plays, compares, and keeps sending and exporting in step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.motion import Motion, Pose
from studio.playback.player import Player
from studio.playback.vmc_target import PoseSource
from studio.project import Run
from studio.ui import background, messages
from studio.ui.review import clip, sounds
from studio.ui.review.clip import Captured, Clip, Source, Tuned, sources, world_of
from studio.ui.review.comparing import Comparison
from studio.ui.review.exporting import Exhibit, Exporting
from studio.ui.review.predicting import Predicting
from studio.ui.review.sending import Sending
from studio.ui.review.view import ReviewView
from studio.ui.session import Session

FRAME_MS = 16
TUNE_MS = 120
CAPTURED_COLOUR, PREDICTED_COLOUR = 1, 0


class ReviewPresenter(QObject):
    """Thought of the Review tab. Loading and tuning run on the pool, generating in a child process."""

    def __init__(self, view: ReviewView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        self._sources: tuple[Source, ...] = ()
        self._sounds: dict[Path, float] = {}  # what was dropped, with its seconds
        self._source: Source | None = None
        self._run_id = ""
        self._captured_only = False  # whether "no run" is a choice, or only where nothing was chosen
        self._captured = Captured(None, 0.0, None)
        self._predicted: Motion | None = None
        self._tuned: Motion | None = None  # the motion that is seen, sent and exported
        self._comparison: Comparison | None = None
        self._player: Player | None = None
        self._active = False
        self._dirty = True
        self._loads = self._tunes = 0  # newest request wins
        self._span: tuple[float, float] | None = None
        self._frames = QTimer(self)
        self._frames.setTimerType(Qt.TimerType.PreciseTimer)
        self._frames.setInterval(FRAME_MS)
        self._frames.timeout.connect(self._show_frame)
        self._tune_timer = QTimer(self)
        self._tune_timer.setSingleShot(True)
        self._tune_timer.setInterval(TUNE_MS)
        self._tune_timer.timeout.connect(self._tune)
        self._predicting = Predicting(self)
        self._sending = Sending(view.send, session, self._pose_source)
        self._exporting = Exporting(view.export, self._exhibit, lambda: session.project)
        self._connect()
        self._on_project()

    def activate(self) -> None:
        """The tab is shown."""
        self._active = True
        wanted, self._session.wanted_run = self._session.wanted_run, ""
        if not wanted and not self._run_id and not self._captured_only:
            wanted = self._newest_run()
        before = self._source
        if wanted:
            self._run_id = wanted
        self._show_lists()
        if wanted and before is not None and self._source is before:
            self._predict()
        self._frames.start()
        QTimer.singleShot(300, self, self._warm_up)

    def deactivate(self) -> None:
        """Another tab is shown; sending goes on, the sound rests."""
        self._active = False
        self._frames.stop()
        if self._player is not None:
            self._player.pause()

    def close(self) -> None:
        """The window closes."""
        self._frames.stop()
        self._tune_timer.stop()
        self._sending.close()
        self._exporting.close()
        self._predicting.close()
        if self._player is not None:
            self._player.close()
        self._view.stage.dispose()

    def _connect(self) -> None:
        view, session = self._view, self._session
        view.source_chosen.connect(self._on_source)
        view.add_sound_requested.connect(self._on_add_sound)
        view.run_chosen.connect(self._on_run)
        view.generate_cancelled.connect(self._on_cancel_generate)
        view.sound_removed.connect(self._on_sound_removed)
        self._predicting.predicted.connect(self._on_predicted)
        self._predicting.progressed.connect(view.show_generating)
        self._predicting.failed.connect(self._on_not_predicted)
        view.play_toggled.connect(self._on_play)
        view.seek_requested.connect(self._on_seek)
        view.step_requested.connect(self._on_step)
        view.loop_toggled.connect(self._on_loop)
        view.ghost_toggled.connect(lambda _: self._show_layout())
        view.curve_chosen.connect(lambda _: self._show_curves())
        view.train_requested.connect(lambda: session.tab_requested.emit("train"))
        view.record_requested.connect(lambda: session.tab_requested.emit("record"))
        view.timeline.span_selected.connect(self._on_span)
        view.tune.tuning_changed.connect(lambda _: self._tune_timer.start())
        session.project_opened.connect(self._on_project)
        session.takes_changed.connect(self._show_lists)
        session.runs_changed.connect(self._show_lists)
        session.sound_dropped.connect(lambda path: self.add_sounds([Path(str(path))]))

    # -- lists -------------------------------------------------------------------------------------

    def add_sounds(self, paths: list[Path]) -> None:
        """Keep sounds in the project and show the first."""
        project = self._session.project
        if project is None or not paths:
            return

        def kept(found: list[Path]) -> None:
            if project is not self._session.project:
                return
            self._sounds = dict.fromkeys(found, 0.0) | self._sounds
            self._show_lists()
            self._on_source(f"sound:{found[0]}")
            self._show_lists()

        background.run(
            lambda: [sounds.keep(project, path) for path in paths], kept, self._on_load_error, owner=self
        )

    def _on_sound_removed(self, key: str) -> None:
        project, source = self._session.project, self._find(key)
        if project is None or source is None or source.sound is None or source.take is not None:
            return
        if self._source is not None and self._source.key == key:
            self._forget()  # lets go of the file
            self._source = None
        try:
            if source.sound.parent == project.folder / sounds.FOLDER:
                sounds.remove(project, source.sound)
        except StudioError as error:
            messages.show_error(self._view, error)
            return
        self._sounds.pop(source.sound, None)
        self._show_lists()
        messages.show_note(self._view, self.tr("{0} is in the project's trash.").format(source.sound.name))

    def _on_add_sound(self) -> None:
        kinds = self.tr("Sound and video (*.wav *.mp3 *.flac *.ogg *.m4a *.aac *.mp4 *.mov *.mkv *.webm)")
        found, _ = QFileDialog.getOpenFileNames(self._view, self.tr("Add a sound"), "", kinds)
        if found:
            self.add_sounds([Path(name) for name in found])

    def _on_project(self) -> None:
        project = self._session.project
        self._source, self._run_id, self._captured_only = None, "", False
        self._sounds = dict.fromkeys(sounds.kept_sounds(project), 0.0) if project is not None else {}
        self._forget()
        self._show_lists()

    def _show_lists(self) -> None:
        """Bring sources and runs up to date, while they are seen; a thousand takes cost time."""
        project = self._session.project
        if project is not None and not self._active:
            return
        self._sources = sources(project, self._sounds) if project is not None else ()
        self._view.show_empty(not self._sources)
        if self._source is not None and self._find(self._source.key) is None:
            self._forget()
            self._source = None
        self._view.show_sources(self._sources, self._source.key if self._source else "")
        runs = [run.id for run in self._usable_runs()]
        if self._run_id not in runs:
            self._run_id = ""
        self._view.show_runs(runs, self._run_id)
        if self._source is None and self._sources:
            self._choose(self._first_source())

    def _find(self, key: str) -> Source | None:
        return next((source for source in self._sources if source.key == key), None)

    def _usable_runs(self) -> list[Run]:
        project = self._session.project
        return [run for run in project.runs if run.has_weights] if project is not None else []

    def _newest_run(self) -> str:
        """The run trained last, so that a person sees what it learnt without looking for it."""
        runs = self._usable_runs()
        trained = [(run.folder.stat().st_mtime, run.id) for run in runs]
        return max(trained)[1] if trained else ""

    def _first_source(self) -> Source:
        """A take nobody trained on where there is one: that is what a model is judged by."""
        project = self._session.project
        assert project is not None
        for split in ("test", "val"):
            used = {selection.take for selection in project.dataset.of_split(split)}
            for source in self._sources:
                if source.take is not None and source.take.id in used:
                    return source
        return self._sources[0]

    # -- what is on the stage ----------------------------------------------------------------------

    def _on_source(self, key: str) -> None:
        source = self._find(key)
        if source is not None and (self._source is None or source.key != self._source.key):
            self._choose(source)

    def _on_run(self, run_id: str) -> None:
        self._run_id, self._captured_only = run_id, not run_id
        self._predict()

    def _choose(self, source: Source) -> None:
        project = self._session.project
        if project is None:
            return
        self._forget()
        self._source = source
        self._show_lists()
        self._loads += 1
        turn = self._loads
        device = self._session.settings.audio_output or None

        def loaded(found: Clip) -> None:
            if turn != self._loads:
                found.player.close()
            else:
                self._show_loaded(found)

        background.run(lambda: clip.load(project, source, device), loaded, self._on_load_error, owner=self)

    def _on_load_error(self, error: BaseException) -> None:
        messages.show_error(self._view, error)
        sentence = error.what if isinstance(error, StudioError) else str(error)
        self._view.stage.predicted.show_nothing(sentence, "mdi6.alert-outline")

    def _show_loaded(self, loaded: Clip) -> None:
        self._captured, self._player = loaded.captured, loaded.player
        if self._source is not None and self._source.sound in self._sounds:
            self._sounds[self._source.sound] = loaded.player.duration
            self._show_lists()
        timeline = self._view.timeline
        timeline.set_duration(loaded.player.duration)
        timeline.set_sound(loaded.peaks)
        start, end = self._used()
        outside = [span for span in ((0.0, start), (end, loaded.player.duration)) if span[1] - span[0] > 0.01]
        timeline.set_excluded(outside)
        if start > 0:
            loaded.player.seek(start)
        self._on_loop(self._view.loop.isChecked())
        self._predict()

    def _forget(self) -> None:
        """Clear the stage."""
        self._predicting.cancel()
        self._loads += 1
        self._tunes += 1
        if self._player is not None:
            self._player.close()
            self._player = None
        self._captured = Captured(None, 0.0, None)
        self._predicted = self._tuned = self._comparison = None
        self._span = None
        self._view.timeline.set_duration(0.0)
        self._view.show_metrics("", "")
        self._view.meters.set_names(())
        self._view.export.show_target("", None, False)
        self._dirty = True

    # -- predicting --------------------------------------------------------------------------------

    def _predict(self) -> None:
        """Show the chosen run's motion for the source, and meanwhile what was captured."""
        project, source = self._session.project, self._source
        self._predicted = None
        self._predicting.cancel()
        if project is not None and source is not None and self._run_id and source.sound is not None:
            self._predicting.request(project, project.run(self._run_id), source.sound)
        self._tune()

    def _on_predicted(self, motion: Motion) -> None:
        self._predicted = motion
        self._tune()

    def _on_not_predicted(self, error: BaseException) -> None:
        messages.show_error(self._view, error)
        self._tune()

    def _on_cancel_generate(self) -> None:
        self._predicting.cancel()
        self._run_id, self._captured_only = "", True
        self._show_lists()
        self._tune()

    # -- tuning ------------------------------------------------------------------------------------

    def _tune(self) -> None:
        """Lay the sliders over the main motion, and compare it with the captured one."""
        self._tunes += 1
        turn, tuning = self._tunes, self._view.tune.tuning
        main = self._predicted if self._predicted is not None else self._captured.motion
        truth = self._captured.motion if self._predicted is not None else None
        if main is None:
            self._tuned = self._comparison = None
            self._show_motion()
            return

        def show(result: Tuned) -> None:
            if turn == self._tunes:
                self._tuned, self._comparison = result.motion, result.comparison
                self._show_motion()

        background.run(lambda: clip.tune(main, truth, tuning), show, owner=self)

    def _show_motion(self) -> None:
        view, main = self._view, self._tuned
        names = clip.lively(main, self._captured.motion)
        view.meters.set_names(names)
        chosen = view.curve.currentText()
        view.show_curve_choices(names, chosen if chosen in names else (names[0] if names else ""))
        self._show_layout()
        self._show_curves()
        comparison = self._comparison
        view.timeline.set_heat(
            comparison.times if comparison else None, comparison.heat if comparison else None
        )
        view.show_metrics(*self._metrics())
        self._sending.refresh()
        project = self._session.project
        name = self._name()
        body = main is not None and bool(main.bone_names)
        view.export.show_target(name, project.exports_folder if project else None, main is not None, body)
        view.tune.show_available(face=main is not None and bool(main.shape_names), bones=body)
        self._dirty = True

    def _show_layout(self) -> None:
        view, stage = self._view, self._view.stage
        predicted, captured = self._predicted, self._captured.motion
        both = predicted is not None and captured is not None
        ghostly = both and bool(predicted and predicted.bone_names) and bool(captured and captured.bone_names)
        bones = any(motion is not None and motion.bone_names for motion in (predicted, captured))
        view.show_ghost_choice(ghostly, bones)
        view.show_legend(both)
        stage.set_layout(captured is not None, predicted is not None, ghostly and view.ghost.isChecked())
        stage.predicted.set_caption(self.tr("Predicted by {0}").format(self._run_id))
        stage.captured.set_caption(self.tr("Captured"))
        if predicted is None and captured is None:
            sentence = self.tr("The motion is being made.") if self._predicting.busy else self.tr(
                "Choose a run to see what it makes of this sound."
            )  # fmt: skip
            stage.predicted.show_nothing(sentence)
        self._dirty = True

    def _show_curves(self) -> None:
        name, curves = self._view.curve.currentText(), {}
        for words, motion, colour in (
            (self.tr("captured"), self._captured.motion, CAPTURED_COLOUR),
            (self.tr("predicted"), self._tuned if self._predicted is not None else None, PREDICTED_COLOUR),
        ):
            if motion is not None and name in motion.shape_names:
                values = motion.shapes[:, motion.shape_names.index(name)]
                curves[words] = (motion.times, np.asarray(values, dtype=np.float64), colour)
        self._view.timeline.set_curves(curves)

    def _metrics(self) -> tuple[str, str]:
        c = self._comparison
        if c is None:
            return "", ""
        parts = []
        if c.rmse is not None:
            parts.append(self.tr("error {0}").format(f"{c.rmse:.3f}"))
        if c.pearson is not None:
            parts.append(self.tr("r {0}").format(f"{c.pearson:.2f}"))
        if c.motion_ratio is not None:
            parts.append(self.tr("motion {0}").format(f"{c.motion_ratio:.2f}"))
        if c.degrees is not None:
            parts.append(self.tr("bones {0}°").format(f"{c.degrees:.1f}"))
        tip = self.tr(
            "Root mean square error, correlation and amount of motion of the blend shapes, and mean angle "
            "of the bones, of what is on screen against what was captured."
        )
        return "   ".join(parts), tip

    def _name(self) -> str:
        if self._source is None:
            return ""
        return f"{self._source.title}_{self._run_id}" if self._predicted is not None else self._source.title

    # -- transport ---------------------------------------------------------------------------------

    def _on_play(self) -> None:
        if self._player is None:
            return
        self._player.toggle()
        problem = self._player.problem
        self._view.show_notice(problem.what if problem else "")

    def _on_seek(self, t: float) -> None:
        if self._player is not None:
            self._player.seek(min(t, self._player.duration))
            self._dirty = True

    def _on_step(self, frames: int) -> None:
        if self._player is not None:
            motion = self._tuned
            fps = motion.fps if motion is not None and motion.fps > 0 else 60.0
            self._on_seek(self._player.position + frames / fps)

    def _on_span(self, span: tuple[float, float] | None) -> None:
        self._span = span
        self._view.timeline.set_span(span)
        self._on_loop(self._view.loop.isChecked())

    def _on_loop(self, on: bool) -> None:
        if self._player is None:
            return
        loop = (self._span or self._used()) if on else None
        self._player.set_loop(loop)
        self._view.timeline.set_loop(self._player.loop)
        if loop is not None and not loop[0] <= self._player.position < loop[1]:
            self._on_seek(loop[0])

    def _used(self) -> tuple[float, float]:
        """The part of the sound that is used, seconds."""
        duration = self._player.duration if self._player is not None else 0.0
        end = self._captured.out_point
        return self._captured.in_point, duration if end is None else min(end, duration)

    # -- the picture -------------------------------------------------------------------------------

    def _show_frame(self) -> None:
        """Bring the stage to where the sound is. Runs at the display's pace while the tab is shown."""
        player = self._player
        if player is None:
            if self._dirty:
                self._dirty = False
                self._view.show_transport(False, 0.0, 0.0)
            return
        playing = player.playing
        if not playing and not self._dirty:
            return
        self._dirty = playing  # one more picture after the last moving one
        t = player.position
        self._view.show_transport(playing, t, player.duration)
        self._view.timeline.set_playhead(t, follow=playing)
        self._show_pose(t)
        if player.problem is not None and playing:
            self._view.show_notice(player.problem.what)

    def _show_pose(self, t: float) -> None:
        stage = self._view.stage
        truth = predicted = None
        captured = self._captured.motion if self._predicted is not None else self._tuned
        world = None
        if captured is not None and len(captured):
            world, truth = world_of(captured, t)
            if stage.captured.isVisible():
                stage.captured.show_pose(captured.skeleton, world, truth)
        if self._predicted is not None and self._tuned is not None and len(self._tuned):
            guess, predicted = world_of(self._tuned, t)
            stage.predicted.show_pose(self._tuned.skeleton, guess, predicted)
            if stage.ghost and captured is not None and world is not None:
                stage.predicted.figure.show_ghost(world, captured.skeleton)
        self._view.meters.show_values(predicted, truth)

    def _warm_up(self) -> None:
        if self._active and not self._session.rolling:
            self._view.stage.warm_up()

    # -- for sending and exporting -----------------------------------------------------------------

    def _pose_source(self) -> PoseSource | None:
        motion, player = self._tuned, self._player
        if motion is None or player is None or not len(motion):
            return None

        def pose_at(t: float) -> Pose:
            return motion.pose(t)

        return PoseSource(motion.shape_names, motion.bone_names, pose_at, lambda: player.position)

    def _exhibit(self) -> Exhibit | None:
        if self._tuned is None or self._source is None or self._player is None:
            return None
        start, end = self._used()
        whole = start <= 0.0 and end >= self._player.duration - 1e-3
        return Exhibit(self._name(), self._tuned, self._source.sound, start, end, whole)
