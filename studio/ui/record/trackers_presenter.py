"""Presenter of the tracker cards: finds who sends on any known port, and listens to it from then on."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QObject

from studio import clock
from studio.capture import trackers
from studio.capture.snapshot import Snapshot
from studio.capture.trackers import TRACKERS, Tracker
from studio.ui import tasks
from studio.ui.messages import counted
from studio.ui.record.model import RecordModel
from studio.ui.record.trackers_view import WEBCAM, TrackerCard, TrackersDialog
from studio.ui.session import Session
from studio.vmc.stream import VMC, Sender
from studio.vmc.vtube_studio import PHONE_PORT

_SOME_PHONE = "192.168. …"
_BY_ID = {one.id: one for one in TRACKERS}


class TrackersPresenter(QObject):
    """Shows the cards, lights those that are heard, and chooses the one heard by itself."""

    def __init__(self, page: TrackersDialog, model: RecordModel, session: Session) -> None:
        super().__init__(page)
        self._page, self._model, self._session = page, model, session
        self._shown: Tracker = TRACKERS[0]
        # Somebody clicked a card: what is heard elsewhere takes it away no more.
        self._picked = False
        self._address = ""
        self._senders: tuple[Sender, ...] = ()
        # Names of the programs by their address: looked up once each.
        self._programs: dict[str, str] = {}
        self._own_program = trackers.own_program()
        tiles = [(one.id, self._translated(one.title)) for one in TRACKERS]
        page.show_tiles([(WEBCAM, self.tr("This webcam")), *tiles])
        page.chosen.connect(self._on_chosen)
        page.use_requested.connect(self._on_use)
        page.phone_chosen.connect(self._on_phone)
        page.practice_requested.connect(self._on_practice)
        page.opened.connect(self._on_opened)
        page.closed.connect(lambda: model.set_finding(False))
        model.trackers_requested.connect(self._on_requested)
        model.text_due.connect(self._show_heard)

    def _on_requested(self) -> None:
        if not (self._session.rolling or self._model.busy or self._model.countdown.running):
            self._page.open_page()

    def _on_opened(self) -> None:
        webcam = bool(self._model.webcam_sender)
        self._picked, self._senders = webcam, ()
        self._address = trackers.own_address()
        self._page.phone.address.setText(self._session.settings.phone)
        self._show(self._shown)
        if webcam:
            self._page.show_webcam()
        self._page.show_heard(frozenset(), self.tr("Listening…"), False)
        self._model.set_finding(True)

    def _on_chosen(self, tracker: str) -> None:
        self._picked = True
        if tracker == WEBCAM:
            self._page.show_webcam()
        else:
            self._show(_BY_ID[tracker])

    def _show(self, tracker: Tracker) -> None:
        self._shown, port = tracker, self._port(tracker)
        address = self._address if tracker.phone else trackers.LOOPBACK
        if tracker.asked:
            # Its pictures show the phone's own address, not where it is to send.
            address, port = _SOME_PHONE, PHONE_PORT
        missing = self.tr("This computer is in no network; connect it to the phone's Wi-Fi.")
        second = self.tr("On another computer, use {0} instead.").format(self._address)
        if tracker.phone:
            note = self._network_note() if self._address else missing
        else:
            note = second if self._address else ""
        steps = tuple(
            (step.picture, self._translated(step.text).format(address=address or "…", port=port))
            for step in tracker.steps
        )
        title = self._translated(tracker.title)
        self._page.show_card(
            TrackerCard(tracker.id, title, steps, address, port, tracker.phone, note, tracker.asked)
        )

    def _network_note(self) -> str:
        """What a phone needs that is not so by itself; "" where it is."""
        if self._session.settings.vmc_host == trackers.EVERYWHERE:
            return ""
        return self.tr(
            "A phone reaches this computer only while Motion is set to “My network”. That is on while this "
            "page is open, and stays on only with “Use this tracker”."
        )

    def _port(self, tracker: Tracker) -> int:
        """Where it is to send: a program to the port that is listened to when this page is closed, too."""
        return tracker.port if tracker.own_port else self._session.settings.vmc_port

    # -- who is heard ----------------------------------------------------------------------------

    def _show_heard(self, snap: Snapshot) -> None:
        if not self._page.isVisible():
            return
        heard_now = trackers.fresh(snap.sources, clock.now())
        # The webcam of this window is no other VMC program.
        self._senders = tuple(one for one in heard_now if one.sender != self._model.webcam_sender)
        mine = frozenset({WEBCAM} if len(self._senders) < len(heard_now) else ())
        for sender in self._senders:
            self._look_up(sender)
        practising = tuple(one for one in self._senders if self._practises(one))
        self._senders = tuple(one for one in self._senders if one not in practising)
        known = [one for one in self._senders if one.sender in self._programs]
        found = [trackers.tracker_of(one, self._programs[one.sender]) for one in known]
        if found and not self._picked and self._shown not in found:
            self._show(found[0])
        heard = self._heard()
        lit = frozenset(one.id for one in found) | ({self._shown.id} if heard else frozenset())
        sentence = self._sentence(heard, snap)
        if heard is None and self._shown.kind in {one.kind for one in practising}:
            sentence = self.tr("This is the practice performer. Listening for a tracker…")
        self._page.phone.show_phone(*self._model.phone_status)
        self._page.show_heard(lit | mine, sentence, heard is not None)

    def _heard(self) -> Sender | None:
        """Who sends as the card shown does; any VMC program may be the one meant."""
        return next((one for one in self._senders if one.kind == self._shown.kind), None)

    def _practises(self, sender: Sender) -> bool:
        """Whether it is, or may yet turn out to be, the practice performer: that is no tracker."""
        if not self._model.practice.on or sender.kind != VMC or not trackers.is_here(sender):
            return False
        # It runs in the same interpreter as this window; some systems name no program.
        return self._programs.get(sender.sender, "") in ("", self._own_program)

    def _sentence(self, heard: Sender | None, snap: Snapshot) -> str:
        port = self._port(self._shown)
        if heard is not None:
            bones = counted(len(heard.bones), self.tr("1 bone"), self.tr("{0} bones"))
            shapes = counted(len(heard.shapes), self.tr("1 shape"), self.tr("{0} shapes"))
            text = self.tr("I hear it on port {0}: {1}, {2}.")
            return text.format(heard.port or port, bones, shapes)
        if port not in snap.ports:
            text = self.tr("Port {0} is used by another program; close it, or use another port.")
            return text.format(port)
        if self._shown.asked:
            # That port is told to the phone by itself, and typed nowhere.
            asked = bool(self._model.phone_status[0])
            return self.tr("Waiting for the phone…") if asked else self.tr("Type the phone's address above.")
        return self.tr("Listening on port {0}…").format(port)

    def _look_up(self, sender: Sender) -> None:
        if sender.sender in self._programs:
            return
        if not trackers.is_here(sender):
            self._programs[sender.sender] = ""
            return

        def done(program: str) -> None:
            self._programs[sender.sender] = program

        tasks.run(lambda: trackers.program_of(sender), done, lambda _e: done(""), owner=self)

    # -- what is done with it --------------------------------------------------------------------

    def _on_use(self) -> None:
        heard = self._heard()
        if heard is None:
            return
        settings, port = self._session.settings, heard.port or self._port(self._shown)
        if self._shown.own_port:
            # Beside the port of the body, which another program may send.
            choice: dict[str, object] = {
                "more_ports": tuple(dict.fromkeys((*settings.more_ports, str(port))))
            }
        else:
            choice = {"vmc_port": port}
        if self._shown.asked:
            choice["phone"] = self._model.phone_status[0] or settings.phone
        if not trackers.is_here(heard):
            choice["vmc_host"] = trackers.EVERYWHERE
        self._session.change_settings(**choice)
        self._page.accept()

    def _on_phone(self, address: str) -> None:
        if address:
            self._model.phone_tried.emit(address, self._shown.kind)
        else:
            self._model.phone_requested.emit("")

    def _on_practice(self) -> None:
        self._page.accept()
        self._model.set_practising(True)

    def _translated(self, text: str) -> str:
        return QCoreApplication.translate("Trackers", text)
