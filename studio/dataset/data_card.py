"""What a dataset holds, counted: minutes by performer, emotion, label and split, channels that move, grades.

Seconds are those used: from in to out without what is excluded. Nothing is guessed: a take nobody named is
counted as not said. The page is one HTML file with its pictures drawn inside, nothing fetched from anywhere.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Dataset, Selection, overlap
from studio.errors import StudioError
from studio.motion import Motion, rotation
from studio.take.motion_file import load_motion
from studio.take.take import Take

if TYPE_CHECKING:
    from studio.take.check import Report
from collections.abc import Iterable
from html import escape
from pathlib import Path

from studio import __version__
from studio.files import atomic

NOT_SAID = ""
"""The key of what nobody named."""
SHAPE_MOVES, BONE_MOVES = 0.005, 0.25
"""Deviation from which a channel counts as moving: of a weight, and of a bone's turn in degrees."""

Seconds = dict[str, float]
Count = TypeVar("Count", int, float)


@dataclass(frozen=True)
class ChannelActivity:
    """How much one channel moves over all takes that have it.

    Args:
        name: of the shape or bone.
        is_bone: a bone's turn in degrees; else a weight 0..1.
        spread: standard deviation; of a bone, the root mean square angle from its mean pose in each take.
        takes: how many takes have it.
    """

    name: str
    is_bone: bool
    spread: float
    takes: int

    @property
    def moves(self) -> bool:
        """Whether there is anything to learn from it."""
        return self.spread > (BONE_MOVES if self.is_bone else SHAPE_MOVES)


@dataclass(frozen=True)
class CardFacts:
    """Everything a data card says.

    Args:
        name: of the project.
        takes, selections, missing, unused: counts; unused are selections not used for anything.
        seconds: used, all together.
        by_split, by_performer, by_emotion: seconds.
        by_label: seconds and count by (tier, text), used spans only.
        channels: shapes, then bones, the liveliest first.
        motion_rates, sound_rates: seconds by rounded frames a second, and by Hz; 0 where there is none.
        grades: takes by "A" to "D"; those not checked are not in it.
        reasons: how often each kind of finding above a note was made.
        unread: sentences for motion that could not be read.
    """

    name: str
    takes: int = 0
    selections: int = 0
    missing: int = 0
    unused: int = 0
    seconds: float = 0.0
    by_split: tuple[tuple[str, float], ...] = ()
    by_performer: tuple[tuple[str, float], ...] = ()
    by_emotion: tuple[tuple[str, float], ...] = ()
    by_label: tuple[tuple[str, str, int, float], ...] = ()
    channels: tuple[ChannelActivity, ...] = ()
    motion_rates: tuple[tuple[int, float], ...] = ()
    sound_rates: tuple[tuple[int, float], ...] = ()
    grades: tuple[tuple[str, int], ...] = ()
    reasons: tuple[tuple[str, int], ...] = ()
    unread: tuple[str, ...] = ()


def card_facts(
    name: str,
    dataset: Dataset,
    takes: Mapping[str, Take],
    reports: Mapping[str, Report],
    on_progress: Callable[[float], None] = lambda fraction: None,
) -> CardFacts:
    """Count what is used; reads the motion of every take used, one after another.

    Args:
        name: of the project.
        dataset: the choices.
        takes: by id; a selection whose take is not there counts as missing.
        reports: checks by take id, those that were made.
        on_progress: told which fraction of the takes was read.
    """
    used = [(s, takes[s.take]) for s in dataset.selections if s.split and s.take in takes]
    facts = _counted(CardFacts(name), used)
    chosen = {take.id: take for _, take in used}
    channels, unread = _channels(tuple(chosen.values()), on_progress)
    graded = [reports[take_id] for take_id in chosen if take_id in reports]
    reasons: dict[str, int] = defaultdict(int)
    for report in graded:
        for kind in {finding.kind for finding in report.findings if finding.severity != "note"}:
            reasons[kind] += 1
    return replace(
        facts,
        takes=len(chosen),
        selections=len(used),
        missing=sum(s.take not in takes for s in dataset.selections),
        unused=sum(not s.split for s in dataset.selections),
        channels=channels,
        grades=tuple((g, sum(r.grade == g for r in graded)) for g in "ABCD") if graded else (),
        reasons=_largest(reasons),
        unread=unread,
    )


def _counted(facts: CardFacts, used: Sequence[tuple[Selection, Take]]) -> CardFacts:
    split: Seconds = dict.fromkeys(("train", "val", "test"), 0.0)
    performer, emotion = defaultdict[str, float](float), defaultdict[str, float](float)
    motion, sound = defaultdict[int, float](float), defaultdict[int, float](float)
    labels: dict[tuple[str, str], tuple[int, float]] = {}
    for selection, take in used:
        seconds = selection.seconds(take.info.duration)
        split[selection.split] += seconds
        performer[selection.performer] += seconds
        motion[round(take.info.fps) if take.info.motion_file else 0] += seconds
        sound[take.info.sample_rate if take.info.audio_file else 0] += seconds
        for text, part in _emotions(selection, take.info.duration, seconds).items():
            emotion[text] += part
        for label, part in _labels(selection, take.info.duration):
            count, before = labels.get(label, (0, 0.0))
            labels[label] = (count + 1, before + part)
    return replace(
        facts,
        seconds=sum(split.values()),
        by_split=tuple(split.items()),
        by_performer=_largest(performer),
        by_emotion=_largest(emotion),
        by_label=tuple(
            (*key, *labels[key]) for key in sorted(labels, key=lambda k: (k[0], -labels[k][1], k))
        ),
        motion_rates=tuple(sorted(motion.items())),
        sound_rates=tuple(sorted(sound.items())),
    )


def _labels(selection: Selection, duration: float) -> list[tuple[tuple[str, str], float]]:
    """((tier, text), seconds of it that are used) for each label that lies in what is used."""
    start, end = selection.span(duration)
    found = []
    for label in selection.labels:
        first, last = max(label.t, start), min(label.t + label.duration, end)
        part = last - first - overlap(selection.excluded, first, last)
        is_moment = label.duration == 0 and start <= label.t <= end
        left_out = any(a <= label.t < b for a, b in selection.excluded)
        if part > 1e-6 or (is_moment and not left_out):
            found.append(((label.tier, label.text), max(part, 0.0)))
    return found


def _emotions(selection: Selection, duration: float, seconds: float) -> Seconds:
    """Seconds by emotion: what its labels say, and for the rest what is said of the whole."""
    found: Seconds = defaultdict(float)
    for (tier, text), part in _labels(selection, duration):
        if tier == "emotion":
            found[text] += part
    # What no label covers is said of the whole selection.
    rest = seconds - sum(found.values())
    if rest > 1e-6:
        found[selection.emotion or NOT_SAID] += rest
    return found


def _channels(
    takes: Sequence[Take], on_progress: Callable[[float], None]
) -> tuple[tuple[ChannelActivity, ...], tuple[str, ...]]:
    sums: dict[tuple[str, bool], tuple[float, float, int]] = {}
    unread: list[str] = []
    for count, take in enumerate(takes, 1):
        try:
            motion = load_motion(take)
        # One damaged take must not cost the card of all others; it is named on it instead.
        except StudioError as error:
            unread.append(error.what)
            motion = None
        for key, (total, frames) in _movement(motion).items() if motion is not None else ():
            before = sums.get(key, (0.0, 0.0, 0))
            sums[key] = (before[0] + total, before[1] + frames, before[2] + 1)
        on_progress(count / len(takes))
    found = [
        ChannelActivity(name, is_bone, float(np.sqrt(total / max(frames, 1.0))), takes_)
        for (name, is_bone), (total, frames, takes_) in sums.items()
    ]
    return tuple(sorted(found, key=lambda c: (c.is_bone, -c.spread, c.name))), tuple(unread)


def _movement(motion: Motion) -> dict[tuple[str, bool], tuple[float, int]]:
    """(sum of squares, frames) by (name, whether it is a bone)."""
    found: dict[tuple[str, bool], tuple[float, int]] = {}
    for i, name in enumerate(motion.shape_names):
        found[name, False] = _squares(motion.shapes[:, i].astype(np.float64))
    for j, name in enumerate(motion.bone_names):
        q = motion.rotations[:, j].astype(np.float64)
        found[name, True] = (float(np.sum(_from_mean(q) ** 2)), len(q))
    return found


def _squares(values: NDArray[np.float64]) -> tuple[float, int]:
    return (float(np.sum((values - values.mean()) ** 2)) if len(values) else 0.0), len(values)


def _from_mean(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees of each rotation (T, 4) from their mean pose, (T,)."""
    if not len(q):
        return np.zeros(0)
    # q and -q are one rotation; unsorted, their mean could be nothing.
    even = rotation.sign_continuous(q)
    mean = even.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length < 1e-9:
        return np.full(len(q), 180.0)
    angles: NDArray[np.float64] = np.degrees(rotation.angle_between(even, mean / length))
    return angles


def _largest(counts: Mapping[str, Count]) -> tuple[tuple[str, Count], ...]:
    return tuple(sorted(counts.items(), key=lambda item: (item[0] == NOT_SAID, -item[1], item[0])))


MOST_CHANNELS = 40
"""Bars of channels that move; the rest is named in a line."""
_COLOURS = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#0072B2", "#8f8f8f")
_SPLITS = {"train": "Training", "val": "Validation", "test": "Test"}
_SPLIT_COLOURS = {"train": "#56B4E9", "val": "#E69F00", "test": "#CC79A7"}
_GRADES = {"A": "#4CC38A", "B": "#8CC34C", "C": "#F5B83D", "D": "#F2777A"}
_WIDE, _ROW, _NAMES = 640, 24, 190
_STYLE = """
:root{color-scheme:light dark;--ground:#fff;--text:#1c1f25;--muted:#5b6472;--line:#dde1e8;--bar:#eef1f5}
@media(prefers-color-scheme:dark){:root{--ground:#14161a;--text:#e8eaed;--muted:#a3abb8;--line:#343a45;
--bar:#262a32}}
body{font:15px/1.5 system-ui,"Noto Sans CJK JP",sans-serif;background:var(--ground);color:var(--text);
max-width:720px;margin:32px auto;padding:0 24px}
h1{font-size:26px;margin:0}h2{font-size:17px;margin:32px 0 8px}p{margin:4px 0;color:var(--muted)}
svg{display:block;width:100%;height:auto}svg text{font-size:13px;fill:var(--text)}
svg .n{fill:var(--muted);font-variant-numeric:tabular-nums}.b{fill:var(--bar)}
footer{margin:40px 0 0;border-top:1px solid var(--line);padding:8px 0;font-size:13px;color:var(--muted)}
"""

Bar = tuple[str, float, str, str]
"""(name, value, what is written beside it, colour)."""


def write_card(path: Path, facts: CardFacts, made: str) -> Path:
    """Write the card in one piece.

    Args:
        path: the HTML file.
        facts: what it says.
        made: when, as people read it.

    Raises:
        StudioError: it cannot be written.
    """
    with atomic.written(path) as beside:
        beside.write_text(card_html(facts, made), encoding="utf-8", newline="\n")
    return path


def card_html(facts: CardFacts, made: str) -> str:
    """The card's text."""
    parts = [
        _head(facts),
        _section("Split", _bars(_of_seconds(facts.by_split, facts.seconds, _SPLIT_COLOURS, _SPLITS))),
        _section("Performers", _bars(_of_seconds(facts.by_performer, facts.seconds))),
        _section("Emotions", _bars(_of_seconds(facts.by_emotion, facts.seconds))),
        _labels_html(facts),
        _grades(facts),
        _channels_html("Face: blend shapes", [c for c in facts.channels if not c.is_bone], "", SHAPE_MOVES),
        _channels_html("Body: bones", [c for c in facts.channels if c.is_bone], "°", BONE_MOVES),
        _rates(facts),
        f"<footer>Made by Saia Studio {escape(__version__)} on {escape(made)}.</footer>",
    ]
    title = escape(f"Data card of {facts.name}")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n<body>\n'
        + "\n".join(part for part in parts if part)
        + "\n</body></html>\n"
    )


def minutes(seconds: float) -> str:
    """Seconds as people read a length: "42 s", "3:05 min", "1 h 02 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s" if 0 < seconds < 10 else f"{whole} s"
    if whole < 3600:
        return f"{whole // 60}:{whole % 60:02d} min"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def _head(facts: CardFacts) -> str:
    names = sum(bool(name) for name, _ in facts.by_performer)
    lines = [
        f"{minutes(facts.seconds)} used of {_count(facts.takes, 'take')}, "
        + (_count(names, "performer") if names else "no performer named")
        + "."
    ]
    if facts.selections != facts.takes:
        lines.append(f"The takes are used in {_count(facts.selections, 'part')}.")
    if facts.unused:
        lines.append(f"{_count(facts.unused, 'take or part')} set aside and not counted here.")
    if facts.missing:
        lines.append(f"{_count(facts.missing, 'take')} cannot be found and is not counted here.")
    lines += facts.unread
    return f"<h1>{escape(facts.name)}</h1>" + "".join(f"<p>{escape(line)}</p>" for line in lines)


def _count(number: int, thing: str) -> str:
    if number == 1:
        return f"1 {thing}"
    return f"{number} " + ("takes or parts" if thing == "take or part" else f"{thing}s")


def _section(title: str, inside: str, note: str = "") -> str:
    if not inside:
        return ""
    below = f"<p>{escape(note)}</p>" if note else ""
    return f"<h2>{escape(title)}</h2>{inside}{below}"


def _of_seconds(
    values: Sequence[tuple[str, float]],
    whole: float,
    colours: dict[str, str] | None = None,
    titles: dict[str, str] | None = None,
) -> list[Bar]:
    bars: list[Bar] = []
    for i, (name, seconds) in enumerate(values):
        share = f"  {seconds / whole:.0%}" if whole > 0 else ""
        colour = (colours or {}).get(name) or (_COLOURS[i % len(_COLOURS)] if name else _COLOURS[-1])
        bars.append(((titles or {}).get(name, name) or "not said", seconds, minutes(seconds) + share, colour))
    return bars


def _labels_html(facts: CardFacts) -> str:
    parts = []
    for tier in dict.fromkeys(tier for tier, *_ in facts.by_label):
        mine = [(text, count, seconds) for t, text, count, seconds in facts.by_label if t == tier]
        shown = mine[:12]
        by_length = any(seconds > 0 for *_, seconds in shown)
        bars = [
            (text or "(empty)", seconds if by_length else float(count),
             f"{count}\N{MULTIPLICATION SIGN}" + (f"  {minutes(seconds)}" if seconds else ""), _COLOURS[1])
            for text, count, seconds in shown
        ]  # fmt: skip
        more = f"and {len(mine) - len(shown)} others" if len(mine) > len(shown) else ""
        parts.append(_section(f"Labels: {tier}", _bars(bars), more))
    return "".join(parts)


def _grades(facts: CardFacts) -> str:
    if not facts.grades:
        return ""
    bars = [(grade, float(n), _count(n, "take"), _GRADES[grade]) for grade, n in facts.grades]
    reasons = ", ".join(f"{kind.replace('_', ' ')} ({n})" for kind, n in facts.reasons[:8])
    unchecked = facts.takes - sum(n for _, n in facts.grades)
    note = f"Noticed most often: {reasons}." if reasons else "Nothing to mend was noticed."
    return _section("Grades", _bars(bars), note + (f" {unchecked} not checked." if unchecked else ""))


def _channels_html(title: str, channels: Sequence[ChannelActivity], unit: str, least: float) -> str:
    if not channels:
        return ""
    moving = [c for c in channels if c.moves]
    still = [c.name for c in channels if not c.moves]
    bars = [
        (c.name, c.spread, f"{c.spread:.1f}{unit}" if unit else f"{c.spread:.3f}", _COLOURS[0])
        for c in moving[:MOST_CHANNELS]
    ]
    notes = [f"{len(moving)} of {len(channels)} move (deviation above {least:g}{unit})."]
    if len(moving) > MOST_CHANNELS:
        notes.append(f"The liveliest {MOST_CHANNELS} are drawn.")
    if still:
        notes.append(f"Still: {', '.join(still)}.")
    return _section(title, _bars(bars) or "<p>Nothing moves.</p>", " ".join(notes))


def _rates(facts: CardFacts) -> str:
    bars = [
        (f"{fps} frames a second" if fps else "no motion", seconds, minutes(seconds), _COLOURS[2])
        for fps, seconds in facts.motion_rates
    ]
    bars += [
        (f"{rate / 1000:g} kHz sound" if rate else "no sound", seconds, minutes(seconds), _COLOURS[5])
        for rate, seconds in facts.sound_rates
    ]
    return _section("Rates", _bars(bars))


def _bars(bars: Iterable[Bar]) -> str:
    """Horizontal bars as SVG, names at the left and figures at the right; "" for none."""
    rows = list(bars)
    if not rows:
        return ""
    highest = max((value for _, value, *_ in rows), default=0.0) or 1.0
    room, lines = _WIDE - _NAMES - 130, []
    for i, (name, value, text, colour) in enumerate(rows):
        y = i * _ROW
        wide = max(room * value / highest, 2.0 if value > 0 else 0.0)
        short = name if _width(name) <= 26 else _cut(name)
        lines.append(
            f"<g><title>{escape(name)}: {escape(text)}</title>"
            f'<text x="{_NAMES - 10}" y="{y + 16}" text-anchor="end">{escape(short)}</text>'
            f'<rect class="b" x="{_NAMES}" y="{y + 4}" width="{room}" height="14" rx="3"/>'
            f'<rect x="{_NAMES}" y="{y + 4}" width="{wide:.1f}" height="14" rx="3" fill="{colour}"/>'
            f'<text class="n" x="{_NAMES + room + 8}" y="{y + 16}">{escape(text)}</text></g>'
        )
    words = ", ".join(f"{name} {text}" for name, _, text, _ in rows)
    return (
        f'<svg role="img" aria-label="{escape(words)}" viewBox="0 0 {_WIDE} {len(rows) * _ROW}" '
        f'xmlns="http://www.w3.org/2000/svg">{"".join(lines)}</svg>'
    )


def _width(text: str) -> int:
    """Columns of text, those of Japanese counted twice."""
    return sum(2 if ord(letter) > 0x2E80 else 1 for letter in text)


def _cut(text: str) -> str:
    while _width(text) > 25:
        text = text[:-1]
    return text + "…"
