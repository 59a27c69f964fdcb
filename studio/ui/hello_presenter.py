"""What "Say something" does: a phrase, a sound file or a sentence moves the figure, by the base voice.

No project is needed: what is said lies in a scratch folder that goes when the window closes. Nothing of the
welcome page waits for this module, since it brings numpy and the figure along.
"""

from __future__ import annotations

import shutil
import tempfile
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QThreadPool, QTimer
from PySide6.QtWidgets import QFileDialog, QWidget

from studio import formats
from studio.capture.phrase import LONGEST_S, PhraseRecording
from studio.errors import InputError, StudioError, say
from studio.files import leftovers
from studio.motion import Motion, Skeleton
from studio.performer.speech import read_aloud
from studio.playback.layers import Tuning, tuned
from studio.playback.player import Player
from studio.project import Project
from studio.project.avatars import OWN
from studio.project.run import base_voice
from studio.render.camera import Orbit
from studio.render.world_pose import WorldPose
from studio.settings import NO_MICROPHONE
from studio.sound.sound_file import Sound, sound_blocks, write_sound
from studio.ui import messages, tasks
from studio.ui.generate_task import GenerateTask
from studio.ui.hello_view import HelloView
from studio.ui.imports import SOUNDS
from studio.ui.language import native, sentences
from studio.ui.session import Session
from studio.ui.widgets.figure.pane import Pane

FRAME_MS, WARM_UP_MS, CLOSING_MS = 16, 900, 5_000
FACE = Orbit(azimuth=-14.0, elevation=3.0, zoom=0.3)
LONGEST_FILE_S, FILE_RATE = 30.0, 48_000


class HelloPresenter(QObject):
    """Presenter of the card "Say something".

    Args:
        view: the card.
        session: for the microphone and the loudspeaker to use.
        window: the parent of the file dialog.

    Attributes:
        sound: the file of what was said last.
    """

    def __init__(self, view: HelloView, session: Session, window: QWidget) -> None:
        super().__init__(view)
        self._view, self._session, self._window = view, session, window
        self._said = _Said()
        self.sound = Path()
        self._motion: Motion | None = None
        self._player: Player | None = None
        self._phrase: PhraseRecording | None = None
        self._work = tasks.LatestTask(self)
        # One thread, so that a device is closed before it is opened again; either may take a second.
        self._devices = QThreadPool(self)
        self._devices.setMaxThreadCount(1)
        self._task = GenerateTask(self)
        self._frames = QTimer(self)
        self._frames.setTimerType(Qt.TimerType.PreciseTimer)
        self._frames.setInterval(FRAME_MS)
        self._frames.timeout.connect(self._on_frame)
        self.pane = Pane("hello_pane", "", self.tr("Getting ready…"), "mdi6.human", "figure", face_share=0.5)
        self.pane.figure.set_orbit(FACE)
        self.pane.set_avatar(formats.read_avatar(OWN))
        view.add_figure(self.pane)
        self._connect()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    @property
    def playing(self) -> bool:
        """Whether the figure speaks now."""
        return self._player is not None and self._player.playing

    @property
    def motion(self) -> Motion | None:
        """What the base voice made of what was said last."""
        return self._motion

    def say_file(self, path: Path) -> None:
        """Let the figure say the beginning of a sound file."""
        self._begin(partial(_beginning, path), self.tr("Reading {0}…").format(path.name))

    def stop(self) -> None:
        """Something else is shown: the microphone is closed, and nothing sounds any more."""
        self._work.drop()
        self._task.cancel()
        self._close_phrase()
        self._frames.stop()
        if self._player is not None:
            self._player.pause()
        self._view.show_idle()

    def close(self) -> None:
        """The window closes: no child, no file and no OpenGL stays behind."""
        self.stop()
        if self._player is not None:
            self._player.close()
        self._task.close()
        self._devices.waitForDone(CLOSING_MS)
        self.pane.figure.dispose()
        self._said.close()

    def _connect(self) -> None:
        view = self._view
        view.speak_requested.connect(self._on_speak)
        view.file_requested.connect(self._on_choose)
        view.sentence_entered.connect(self._on_sentence)
        view.play_requested.connect(self._play)
        self._task.predicted.connect(self._on_motion)
        self._task.progressed.connect(self._on_progress)
        self._task.failed.connect(self._on_failed)
        self._session.project_opened.connect(self._on_project)

    def _on_project(self) -> None:
        if self._session.project is not None:
            self.stop()

    def _on_choose(self) -> None:
        endings = " ".join(f"*{suffix}" for suffix in sorted(SOUNDS))
        kinds = self.tr("Sound ({0});;All files (*)").format(endings)
        title = self.tr("Choose a sound file")
        chosen, _ = QFileDialog.getOpenFileName(self._window, title, str(Path.home()), kinds)
        if chosen:
            self.say_file(Path(chosen))

    def _on_sentence(self, text: str) -> None:
        self._begin(partial(read_aloud, text), self.tr("Reading it aloud…"))

    # The microphone

    def _on_speak(self) -> None:
        if self._phrase is not None:
            self._finish_phrase()
            return
        self.stop()
        chosen = self._session.settings.audio_device
        device = chosen if chosen not in ("", NO_MICROPHONE) else None
        self._view.show_busy(self.tr("Switching the microphone on…"))
        self._work.run(
            lambda: PhraseRecording(device),
            self._on_listening,
            self._on_deaf,
            self._let_go,
            self._devices,
        )

    def _on_listening(self, phrase: PhraseRecording) -> None:
        self._phrase = phrase
        self._view.show_microphone(True)
        self._frames.start()

    def _on_deaf(self, error: BaseException) -> None:
        if isinstance(error, InputError):
            # There is no list of devices here, but another way to say something.
            error = StudioError(error.what, self.tr("Plug in a microphone and allow it, or type a sentence."))
            self._view.show_microphone(False)
        self._on_failed(error)

    def _finish_phrase(self) -> None:
        """What was said goes to the base voice; nothing said is told."""
        phrase = self._phrase
        if phrase is not None:
            self._close_phrase()
            self._begin(phrase.sound, self.tr("Getting ready…"))

    def _close_phrase(self) -> None:
        phrase, self._phrase = self._phrase, None
        if phrase is not None:
            self._let_go(phrase)

    def _let_go(self, phrase: PhraseRecording) -> None:
        tasks.run(phrase.close, lambda _: None, pool=self._devices)

    # From a sound to the moving figure

    def _begin(self, make: Callable[[], Sound], text: str) -> None:
        """Make a sound on the thread pool, and ask for its motion."""
        self.stop()
        self._view.show_busy(text)
        self._work.run(lambda: self._said.keep(make()), self._on_sound, self._on_failed)

    def _on_sound(self, said: tuple[Project, Path]) -> None:
        project, self.sound = said
        self._view.show_busy(self.tr("The base voice is listening. A few seconds, longer the first time…"))
        self._task.request(project, base_voice(), self.sound)

    def _on_progress(self, text: str, fraction: float | None) -> None:
        if fraction is not None and fraction >= 0.0:
            self._view.show_busy(self.tr("The base voice makes the motion: {0}").format(text), fraction)

    def _on_motion(self, motion: Motion) -> None:
        sound, device = self.sound, self._session.settings.audio_output or None
        layers = Tuning(blinks=base_voice().blinks)
        self._work.run(
            lambda: (tuned(motion, layers), Player(sound, device=device)),
            self._on_ready,
            self._on_failed,
            lambda made: made[1].close(),
        )

    def _on_ready(self, made: tuple[Motion, Player]) -> None:
        if self._player is not None:
            self._player.close()
        self._motion, self._player = made
        self._view.show_result()
        self._play()

    def _play(self) -> None:
        if self._player is None:
            return
        self._close_phrase()
        self._player.seek(0.0)
        self._player.play()
        problem = self._player.problem
        learnt = self.tr("The base voice has not met you yet. Train it on you, and it moves like you.")
        self._view.show_idle(native(problem.what) if problem else learnt, "warn" if problem else "")
        self._frames.start()

    def _on_frame(self) -> None:
        if self._phrase is not None:
            state = self._phrase.poll()
            self._view.show_listening(state.duration / LONGEST_S, state.spoken)
            if state.ended:
                self._finish_phrase()
        elif self._player is not None and self._motion is not None:
            playing = self._player.playing
            self.pane.show_stance(WorldPose.of(self._motion, self._player.position))
            if not playing:
                self._frames.stop()

    def _on_failed(self, error: BaseException) -> None:
        self._frames.stop()
        if isinstance(error, StudioError):
            self._view.show_idle(sentences(error.what, error.in_window), "warn")
        else:
            self._view.show_idle()
            messages.show_error(self._window, error)

    def _warm_up(self) -> None:
        if self._view.isVisible() and not self.playing and self._phrase is None:
            self.pane.figure.warm_up()
            self.pane.show_stance(WorldPose.rest_pose(Skeleton.humanoid()))


def _beginning(path: Path) -> Sound:
    """The first seconds of a file, mono. Runs on a pool thread."""
    samples = next(sound_blocks(path, FILE_RATE, LONGEST_FILE_S), None)
    if samples is None or not len(samples):
        raise StudioError(say("The sound file {name} is empty.", name=path.name), "Choose another file.")
    return Sound(samples[:, None], FILE_RATE)


class _Said:
    """What was said, as files of a project in a scratch folder; made when the first sound comes."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._folder: Path | None = None
        self._project: Project | None = None
        self._count = 0

    def keep(self, sound: Sound) -> tuple[Project, Path]:
        """Write a sound; gives the project it is for, and its file. Runs on a pool thread."""
        with self._lock:
            if self._project is None:
                self._folder = Path(tempfile.mkdtemp(prefix=leftovers.scratch_prefix("hello")))
                self._project = Project.create(self._folder / "Hello")
            self._count += 1
            # A name of its own each time: what was made of a sound is found by its file.
            file = self._project.folder / f"said_{self._count}.wav"
            write_sound(file, sound)
            return self._project, file

    def close(self) -> None:
        """All of it goes."""
        with self._lock:
            if self._project is not None and self._folder is not None:
                self._project.close()
                shutil.rmtree(self._folder, ignore_errors=True)
                self._project = None
