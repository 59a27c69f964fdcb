"""Presenter of the teleprompter: what to say next, hands-free, and kept as labels of the take."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QLocale, QObject
from PySide6.QtWidgets import QInputDialog

from studio import clock
from studio.capture.snapshot import Snapshot
from studio.dataset import edits, prompts
from studio.dataset.prompts import OWN, PauseWatch, Prompt, PromptSpans
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import messages, tasks
from studio.ui.record.model import TAB, RecordModel, SavedTake
from studio.ui.record.prompter_view import PrompterCard
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.dataset.coverage import RecordingProgress, TakeProgress


SHOWN = 3
"""How many of the goals that are missing are named at once."""


class PrompterPresenter(QObject):
    """Shows prompts one after another, and how far the recordings have come."""

    def __init__(self, card: PrompterCard, model: RecordModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self._prompt: Prompt | None = None
        self._said: Counter[str] = Counter()
        self._spans: PromptSpans | None = None
        self._pause = PauseWatch()
        self._elapsed = 0.0
        # By folder: a take is never altered, so each is read once.
        self._covered: dict[Path, TakeProgress] = {}
        self._reading: set[Path] = set()
        self._coverage: RecordingProgress | None = None
        card.next_requested.connect(self.next)
        card.again_requested.connect(self.again)
        card.language_chosen.connect(lambda code: session.change_settings(prompt_language=code))
        card.own_text_requested.connect(self._on_own_text)
        card.pause_chosen.connect(lambda on: session.change_settings(prompt_pause=on))
        card.shown_chosen.connect(lambda on: session.change_settings(prompter=on))
        model.frame_due.connect(self._follow)
        model.saved.connect(self._on_saved)
        model.practice_changed.connect(self._show_prompt)
        session.rolling_changed.connect(self._on_rolling)
        session.settings_changed.connect(self._on_settings)
        session.project_opened.connect(self._on_project)
        session.takes_changed.connect(self._read_takes)
        session.dataset_changed.connect(self._show_coverage)
        self._show_settings()
        self._on_project()

    @property
    def prompt(self) -> Prompt | None:
        """The one shown."""
        return self._prompt

    # -- by key, pedal or a long pause -----------------------------------------------------------

    def next(self) -> None:
        """It was said well, or is passed over: show another."""
        if self._prompt is not None:
            self._said[self._prompt.text] += 1
        self._choose(self._prompt)
        if self._spans is not None and self._prompt is not None:
            self._spans.go_on(self._prompt, self._elapsed)
        self._pause.begin()

    def again(self) -> None:
        """Say it once more; what was said of it in the take that rolls is left out of training."""
        if self._spans is not None:
            self._spans.again(self._elapsed)
            messages.show_note(self._card, self.tr("Once more. The first try is left out."))
        self._pause.begin()

    def _follow(self, snap: Snapshot) -> None:
        if not self._session.rolling:
            return
        self._elapsed = snap.elapsed
        settings = self._session.settings
        heard = self._spans is not None and settings.prompt_pause and snap.audio_alive
        if heard and self._pause.push(clock.now(), snap.rms_dbfs):
            self.next()

    # -- takes -----------------------------------------------------------------------------------

    def _on_rolling(self, rolling: bool) -> None:
        if not rolling:
            return
        # Of the practice performer it is known that it says something else.
        follows = self._session.settings.prompter and not self._model.practice.on
        self._spans = PromptSpans(self._prompt) if follows and self._prompt is not None else None
        self._elapsed = 0.0
        self._pause = PauseWatch()

    def _on_saved(self, saved: SavedTake) -> None:
        """Keep with the take what was asked for in it."""
        spans, self._spans = self._spans, None
        project, take = self._session.project, saved.take
        if spans is None or project is None or take.id not in project.dataset:
            return
        spans.end(take.info.duration)
        dataset = edits.add_labels(project.dataset, take.id, spans.labels)
        for start, end in spans.excluded:
            dataset = edits.exclude(dataset, take.id, start, end)
        try:
            self._session.edit(self.tr("Prompts of {0}").format(take.id), dataset, TAB)
        except StudioError as error:
            messages.show_error(self._card, error)
        if self._prompt is not None:
            self._said[self._prompt.text] += 1
        self._choose(self._prompt)

    # -- what is there, and what is missing ------------------------------------------------------

    def _on_project(self) -> None:
        self._covered, self._coverage = {}, None
        self._said.clear()
        project = self._session.project
        selections = project.dataset.selections if project is not None else ()
        self._said.update(x.text for s in selections for x in s.labels if x.tier == prompts.TIER)
        self._choose(None)
        self._show_coverage()
        self._read_takes()

    def _read_takes(self) -> None:
        project = self._session.project
        if project is None or self._session.rolling or not self._session.settings.prompter:
            # A recording has the disk to itself; the end of it is told by takes_changed.
            return
        new = [t for t in project.takes if t.folder not in self._covered and t.folder not in self._reading]
        if not new:
            self._show_coverage()
            return
        self._reading.update(take.folder for take in new)

        def done(found: dict[Path, TakeProgress]) -> None:
            self._reading.difference_update(found)
            self._covered.update(found)
            self._show_coverage()

        tasks.run(lambda: _cover(new), done, owner=self)

    def _show_coverage(self) -> None:
        project = self._session.project
        if project is None:
            return
        from studio.dataset.coverage import MILESTONES, progress_of

        known = [self._covered[take.folder] for take in project.takes if take.folder in self._covered]
        found = self._coverage = progress_of(known, project.dataset.selections)
        goals = {
            "loud": self.tr("loud speech"), "quiet": self.tr("quiet speech"), "smiles": self.tr("smiles"),
            "questions": self.tr("questions"), "feelings": self.tr("feelings"), "sounds": self.tr("sounds"),
        }  # fmt: skip
        missing = ", ".join(goals[goal] for goal in found.missing[:SHOWN])
        if len(found.missing) > SHOWN:
            missing = self.tr("{0} and more").format(missing)
        names = dict(
            zip(MILESTONES, (self.tr("a first look"), self.tr("good"), self.tr("excellent")), strict=True)
        )
        minutes, name = int(found.next_milestone / 60), names[found.next_milestone]
        goal = self.tr("Next: {0} min ({1}).").format(minutes, name)
        if found.seconds >= MILESTONES[-1]:
            goal = self.tr("Enough for an excellent model.")
        lack = self.tr("Still missing: {0}.").format(missing) if missing else self.tr("Nothing is missing.")
        details = self.tr("2 min: a first look. 10 min: good. 20 min: excellent.")
        every = ", ".join(goals[goal] for goal in found.missing)
        details += "\n" + self.tr("Still missing: {0}.").format(every) if every else ""
        self._card.show_coverage(found.seconds, MILESTONES, f"{goal} {lack}", details)

    # -- choices ---------------------------------------------------------------------------------

    def _on_settings(self, changed: frozenset[str]) -> None:
        if changed & {"prompter", "prompt_language", "own_prompts", "prompt_pause"}:
            self._show_settings()
        if changed & {"prompt_language", "own_prompts"}:
            self._choose(None)
        if "prompter" in changed:
            self._read_takes()

    def _show_settings(self) -> None:
        settings = self._session.settings
        languages = dict(prompts.languages())
        if settings.own_prompts:
            languages[OWN] = self.tr("My own text")
        own = self.tr("Write your own text…")
        self._card.show_choices(languages, self._language(), own, settings.prompt_pause)
        self._card.show_shown(settings.prompter)

    def _language(self) -> str:
        chosen = self._session.settings.prompt_language
        if chosen in prompts.languages() or (chosen == OWN and self._session.settings.own_prompts):
            return chosen
        return prompts.language_for(QLocale.system().name())

    def _on_own_text(self) -> None:
        title, question = self.tr("Your own text"), self.tr("One prompt per line:")
        before = "\n".join(self._session.settings.own_prompts)
        text, sure = QInputDialog.getMultiLineText(self._card, title, question, before)
        if sure:
            lines = tuple(one.text for one in prompts.own_prompts(text.splitlines()))
            self._session.change_settings(own_prompts=lines, prompt_language=OWN if lines else "")

    def _choose(self, last: Prompt | None) -> None:
        """Show the prompt that comes after another."""
        try:
            language = self._language()
            every = (
                prompts.own_prompts(self._session.settings.own_prompts)
                if language == OWN
                else prompts.prompts_of(language)
            )
        except StudioError as error:
            messages.show_error(self._card, error)
            return
        wanted = self._coverage.wanted if self._coverage is not None else ()
        self._prompt = prompts.next_prompt(every, self._said, wanted, last)
        self._show_prompt()

    def _show_prompt(self) -> None:
        if self._model.practice.on:
            # Two sentences on one page, and nobody would know who says which.
            words = self.tr("It speaks its own lines. Stop it to read prompts yourself.")
            self._card.show_prompt(words, self.tr("Practice performer"))
            return
        kinds = {
            "sentence": self.tr("Say"), "question": self.tr("Ask"), "happy": self.tr("Happily"),
            "sounds": self.tr("Sounds and faces"), "loud": self.tr("Loudly"), "quiet": self.tr("Quietly"),
            "free": self.tr("In your own words"), "sad": self.tr("Sadly"), "angry": self.tr("Angrily"),
            "surprised": self.tr("Surprised"), OWN: self.tr("Your own text"),
        }  # fmt: skip
        shown = self._prompt
        self._card.show_prompt(shown.text if shown else "", kinds[shown.kind] if shown else "")


def _cover(takes: list[Take]) -> dict[Path, TakeProgress]:
    """What each take has; one that cannot be read has nothing. Runs on a pool thread."""
    import numpy as np

    from studio.dataset.coverage import TakeProgress, cover_take

    found = {}
    for take in takes:
        try:
            found[take.folder] = cover_take(take)
        except StudioError:
            found[take.folder] = TakeProgress(0.0, np.zeros(0), None)
    return found
