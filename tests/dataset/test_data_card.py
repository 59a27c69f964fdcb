from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from studio.dataset import Dataset, Label, Selection, edits
from studio.dataset.data_card import CardFacts, card_facts, card_html, minutes, write_card
from studio.motion import Motion, rotation
from studio.take import TakeInfo
from studio.take.check import Report
from studio.take.folder import save_take
from studio.take.take import Finding, Take


def a_take(folder: Path, name: str, frames: int = 300) -> Take:
    """Ten seconds at 30: a mouth that opens, a brow that rests, a head that nods by 10 degrees."""
    times = np.arange(frames) / 30
    turn = rotation.from_axis_angle([1.0, 0.0, 0.0], np.radians(10) * np.sign(np.sin(times * 9 + 0.1)))
    motion = Motion.build(
        times,
        ("A", "Brow"),
        np.stack([(times * 3) % 1, np.full(frames, 0.2)], 1),
        ("Head",),
        None,
        turn[:, None],
    )
    return save_take(folder / name, TakeInfo(name), motion)


@pytest.fixture
def takes(tmp_path: Path) -> dict[str, Take]:
    return {name: a_take(tmp_path, name) for name in ("a", "b")}


def test_seconds_are_those_used(takes: dict[str, Take]) -> None:
    dataset = Dataset(
        (Selection("a", "a", performer="美香", emotion="calm"), Selection("b", "b", split="val"))
    )
    dataset = edits.exclude(edits.trim(dataset, "a", 1.0, 9.0), "a", 2.0, 3.0)
    facts = card_facts("P", dataset, takes, {})
    whole = takes["b"].info.duration
    assert facts.by_split == (("train", pytest.approx(7.0)), ("val", pytest.approx(whole)), ("test", 0.0))
    assert facts.by_performer == (("美香", pytest.approx(7.0)), ("", pytest.approx(whole)))
    assert facts.by_emotion == (("calm", pytest.approx(7.0)), ("", pytest.approx(whole)))
    assert facts.motion_rates == ((30, pytest.approx(7.0 + whole)),)
    assert facts.sound_rates == ((0, pytest.approx(7.0 + whole)),)


def test_labels_count_where_they_are_used_and_say_the_emotion_of_their_span(takes: dict[str, Take]) -> None:
    labels = (
        Label(0.0, 2.0, "emotion", "happy"),
        Label(1.5, 0.0, "gesture", "nod"),
        Label(9.5, 0.4, "sentence", "trimmed away"),
    )
    dataset = Dataset((Selection("a", "a", labels=labels, emotion="calm", out_point=9.0),))
    facts = card_facts("P", edits.exclude(dataset, "a", 0.0, 0.5), takes, {})
    assert facts.by_label == (("emotion", "happy", 1, pytest.approx(1.5)), ("gesture", "nod", 1, 0.0))
    assert dict(facts.by_emotion) == {"calm": pytest.approx(7.0), "happy": pytest.approx(1.5)}


def test_channels_that_move_are_told_from_those_that_rest(takes: dict[str, Take]) -> None:
    facts = card_facts("P", Dataset((Selection("a", "a"), Selection("b", "b"))), takes, {})
    channels = {c.name: c for c in facts.channels}
    assert channels["A"].moves
    assert not channels["Brow"].moves
    assert channels["Head"].spread == pytest.approx(10.0, abs=0.5)
    assert channels["Head"].takes == 2


def test_missing_unused_and_damaged_takes_are_told(takes: dict[str, Take]) -> None:
    dataset = Dataset((Selection("a", "a"), Selection("b", "b", split=""), Selection("gone", "gone")))
    path = takes["a"].motion_path
    assert path is not None
    path.write_bytes(b"nothing")
    facts = card_facts("P", dataset, takes, {})
    assert (facts.takes, facts.missing, facts.unused) == (1, 1, 1)
    assert len(facts.unread) == 1
    assert facts.unread[0] in card_html(facts, "today")


def test_grades_are_a_histogram_with_what_was_noticed_most(takes: dict[str, Take]) -> None:
    quiet = Finding("quiet", "minor", "It is quiet.", "Come nearer.")
    reports = {"a": Report("B", "", (quiet, quiet)), "b": Report("A", "", ())}
    facts = card_facts("P", Dataset((Selection("a", "a"), Selection("b", "b"))), takes, reports)
    assert facts.grades == (("A", 1), ("B", 1), ("C", 0), ("D", 0))
    assert facts.reasons == (("quiet", 1),)


class _Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "data")]
        if tag not in ("meta",):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_by_itself_and_names_are_no_markup(takes: dict[str, Take], tmp_path: Path) -> None:
    name = '<script>alert("x")</script> & 美香'
    dataset = Dataset((Selection("a", "a", performer=name, labels=(Label(0, 1, "sentence", "a < b"),)),))
    path = write_card(tmp_path / "カード.html", card_facts(name, dataset, takes, {}), "2026-01-01")
    text = path.read_text(encoding="utf-8")
    page = _Page(text)
    assert page.open == []
    assert page.addresses == []
    assert "<script" not in text
    pictures = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(pictures) >= 5
    for picture in pictures:
        ElementTree.fromstring(picture)


def test_an_empty_project_has_a_card_too() -> None:
    text = card_html(CardFacts("Empty"), "today")
    assert "0 s used of 0 takes, no performer named." in text


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0 s"), (4.25, "4.2 s"), (42, "42 s"), (185, "3:05 min"), (3725, "1 h 02 min")]
)
def test_lengths_are_written_as_people_read_them(seconds: float, text: str) -> None:
    assert minutes(seconds) == text
