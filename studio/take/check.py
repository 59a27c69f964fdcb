"""What is wrong with a take, in words a performer understands, and a grade."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from studio.errors import StudioError, counted, say
from studio.motion import Motion, lag
from studio.motion.sanitize import sanitized
from studio.take.filmed import beside_findings, filmed_findings
from studio.take.findings import SoundStats, measure_sound, motion_findings, sound_findings, value_findings
from studio.take.motion_file import NO_MOTION_S, read_motion
from studio.take.take import NO_MOTION, SEVERITIES, Finding, Take, TakeInfo

__all__ = ["SEVERITIES", "Finding", "Proof", "Report", "check_take", "proof_of"]

LATE, VERY_LATE = 0.08, 0.3
"""Seconds between mouth and voice that matter, and that spoil a take."""
LEAST_VOICE_S = 8.0
"""Seconds of voice that a mouth has to follow before it is said that it does not."""
MUCH_WITHOUT = 0.1
"""Part of a take that sound without motion at its end spoils."""
_VOICE_ONLY = "Sound only: use it in Review, not for training."
_OF_RECORDING = frozenset({
    "damaged", "incomplete", "journal", "no_motion", "no_sound", "values", "gap", "ends", "starts", "lost",
    "dropped", "late", "rate",
})  # fmt: skip
"""Findings that say that something of what was recorded is not in the files, or came too rarely."""
_ROUNDING = 0.05
"""Seconds by which the length of a sound may differ from what take.json says: formats differ."""


@dataclass(frozen=True)
class Report:
    """The quality of a take.

    Args:
        grade: "A" nothing to mend; "B" small things; "C" something that spoils a part; "D" of no use.
        reason: why that grade, one sentence.
        findings: the worst first.
        fps, jitter_ms: the motion's rate and how unevenly its frames came; 0 without motion.
        offset_ms: how much later the motion has to be moved to fit the voice, None where unknown.
        confidence: of the offset, 0 to 1.
        correlation: of mouth and voice at that offset.
        peak_dbfs, noise_dbfs: of the sound, None without.
        speech: part of the sound that is voice, 0 to 1.
    """

    grade: str
    reason: str
    findings: tuple[Finding, ...]
    fps: float = 0.0
    jitter_ms: float = 0.0
    offset_ms: float | None = None
    confidence: float = 0.0
    correlation: float | None = None
    peak_dbfs: float | None = None
    noise_dbfs: float | None = None
    speech: float = 0.0
    duration: float = 0.0

    def to_plain(self) -> dict[str, Any]:
        """JSON values, as `saia check --json` prints them."""
        plain: dict[str, Any] = {key: value for key, value in vars(self).items() if key != "findings"}
        plain["findings"] = [finding.to_plain() for finding in self.findings]
        return plain


@dataclass(frozen=True)
class Proof:
    """Whether a take is whole, read again from its files.

    Args:
        good: nothing that was recorded is missing.
        what: one sentence: the length, the rate and the loss, or the worst that is wrong.
        remedy: what to do; "" where it is good.
        details: what was counted in the files, one sentence.
    """

    good: bool
    what: str
    remedy: str
    details: str


def proof_of(take: Take, report: Report) -> Proof:
    """What a check of a take says of its recording alone; how well it was performed is its grade."""
    info = take.info
    details = say(
        "Read again from the disk: {frames} of motion, {seconds} s of sound, clocks "
        "{drift} ppm apart and corrected.",
        frames=counted(info.frames, "frame"),
        seconds=f"{info.audio_seconds:.1f}",
        drift=f"{info.drift_ppm:+.0f}",
    )
    for finding in report.findings:
        # Silence and stillness may be meant for a part of a take, but not for all of it.
        wrong = finding.kind in _OF_RECORDING and finding.severity != "note"
        # A few frames that nobody sees are counted below, not cried over.
        if finding.kind in ("lost", "dropped") and finding.severity == "minor":
            continue
        if wrong or finding.severity == "fatal" or (finding.kind, finding.severity) == ("drift", "major"):
            return Proof(False, finding.what, finding.remedy, details)
    if info.source == "recorded" and info.notes:
        # The recorder notes nothing but trouble: sound that was lost, a microphone that went, a full disk.
        return Proof(False, info.notes[0], "Listen to that place, or record it again.", details)
    loss = say("nothing lost")
    if info.frames_lost:
        loss = say("{frames} lost", frames=counted(info.frames_lost, "frame"))
    seconds, fps = f"{info.duration:.1f}", f"{report.fps:.0f}"
    if report.fps:
        what = say("Verified: {seconds} s, {fps} fps, {loss}.", seconds=seconds, fps=fps, loss=loss)
    else:
        what = say("Verified: {seconds} s, {loss}.", seconds=seconds, loss=loss)
    return Proof(True, what, "", details)


def check_take(take: Take) -> Report:
    """Look a take over: rates, gaps, levels, and whether the mouth follows the voice.

    Runs in bounded memory on sound of any length. Damaged files are findings, not errors.
    """
    findings: list[Finding] = []
    motion = _motion(take, findings)
    stats = _sound_stats(take, findings)
    report = Report("A", "", (), duration=take.info.duration)
    if motion is not None:
        found, jitter = motion_findings(motion, _merged(_explained(take.info)))
        findings += found
        report = replace(report, fps=round(motion.fps, 3), jitter_ms=round(jitter * 1000, 3))
    if stats is not None:
        findings += sound_findings(stats, _made_from(take.info.source))
        report = replace(
            report,
            peak_dbfs=round(stats.peak_dbfs, 2),
            noise_dbfs=round(stats.noise_dbfs, 2),
            speech=round(stats.speech, 4),
        )
    if motion is not None and stats is not None:
        found, report = _together(motion, stats, report, take.info)
        findings += found
    findings += _recording(take.info, _stopped(motion) if motion is not None else 0)
    findings += filmed_findings(take.info)
    findings += beside_findings(take.info)
    if take.info.duration < 1.0:
        findings.append(
            Finding(
                "short",
                "minor",
                say("The take lasts only {duration} s.", duration=f"{take.info.duration:.2f}"),
                "Record a longer one.",
            )
        )
    return _graded(report, findings)


def _motion(take: Take, findings: list[Finding]) -> Motion | None:
    if take.motion_path is None:
        findings.append(_no_motion(take.info, "major"))
        return None
    try:
        motion = read_motion(take.motion_path)
    except StudioError as error:
        findings.append(Finding("damaged", "fatal", error.what, error.remedy))
        return None
    if len(motion) < take.info.frames:
        what = say("Only {n} of {all} frames of motion are in the file.", n=len(motion), all=take.info.frames)
        findings.append(Finding("incomplete", "fatal", what, "Check the disk, then record the take again."))
    findings += value_findings(motion) if len(motion) else ()
    # After the values were looked at, since what follows would call the repaired ones fine.
    motion, _ = sanitized(motion)
    if len(motion) < 2:
        findings.append(_no_motion(take.info, "fatal"))
        return None
    return motion


def _no_motion(info: TakeInfo, imported: str) -> Finding:
    """A take without motion; where it was recorded so, that was a mistake, as with sound."""
    if info.source != "recorded":
        return Finding("no_motion", imported, "The take has no motion.", _VOICE_ONLY)
    remedy = say("Start your tracking app and record it again. {use}", use=_VOICE_ONLY)
    return Finding("no_motion", "fatal", "No motion was recorded.", remedy)


def _no_sound(info: TakeInfo) -> Finding:
    if info.source != "recorded":
        return Finding("no_sound", "fatal", "The take has no sound.", "Nothing can be learnt from it.")
    remedy = "Choose a microphone and record it again. Nothing can be learnt from it."
    return Finding("no_sound", "fatal", "No sound was recorded.", remedy)


def _sound_stats(take: Take, findings: list[Finding]) -> SoundStats | None:
    if take.audio_path is None:
        findings.append(_no_sound(take.info))
        return None
    try:
        stats = measure_sound(take.audio_path)
    except StudioError as error:
        findings.append(Finding("damaged", "fatal", error.what, error.remedy))
        return None
    if stats.read_seconds < take.info.audio_seconds - _ROUNDING:
        what = say(
            "Only {seconds} of {all} s of sound are in the file.",
            seconds=f"{stats.read_seconds:.1f}",
            all=f"{take.info.audio_seconds:.1f}",
        )
        findings.append(Finding("incomplete", "fatal", what, "Check the disk, then record the take again."))
    return stats


def _together(
    motion: Motion, stats: SoundStats, report: Report, info: TakeInfo
) -> tuple[list[Finding], Report]:
    findings = []
    start, end = float(motion.times[0]), float(motion.times[-1])
    if stats.duration - end > NO_MOTION_S:
        what = say("Motion ended at {end} of {length}.", end=_clock(end), length=_clock(stats.duration))
        remedy = "Cut the rest off, or record again."
        if any(why == NO_MOTION and b > end for _, b, why in info.left_out):
            remedy = "The rest is left out of training; record again if you need it."
        severity = "major" if stats.duration - end > MUCH_WITHOUT * stats.duration else "minor"
        findings.append(Finding("ends", severity, what, remedy, end, stats.duration))
    elif stats.duration - end > 0.5:
        what = say("The motion ends {seconds} s before the sound.", seconds=f"{stats.duration - end:.1f}")
        findings.append(Finding("ends", "minor", what, "Trim the take to where both are there.", end))
    if end - stats.duration > 0.5:
        what = say("The sound ends {seconds} s before the motion.", seconds=f"{end - stats.duration:.1f}")
        findings.append(
            Finding("ends", "minor", what, "Trim the take to where both are there.", stats.duration)
        )
    if start > 0.5:
        what = say("The motion starts {seconds} s after the sound.", seconds=f"{start:.1f}")
        findings.append(Finding("starts", "minor", what, "Trim the take to where both are there.", 0.0))
    # Too little voice for an offset to be believed.
    if stats.speech < 0.02 or not motion.shape_names:
        return findings, report
    enough = float(stats.is_voice[: int(end * lag.RATE)].sum()) / lag.RATE >= LEAST_VOICE_S
    alignment = lag.voice_offset(lag.level_of(stats.power), motion)
    report = replace(
        report,
        offset_ms=round(alignment.offset * 1000, 1) if alignment.confidence > 0 else None,
        confidence=round(alignment.confidence, 3),
        # Of very little nothing was measured, and nothing is to be said.
        correlation=round(alignment.correlation, 3) if enough or alignment.confidence > 0 else None,
    )
    return findings + list(_lag_findings(alignment, motion, enough)), report


def _lag_findings(alignment: lag.Alignment, motion: Motion, enough: bool) -> Iterator[Finding]:
    """What is wrong with the timing; that the mouth follows nothing only where there was enough to follow."""
    late = -alignment.offset
    if alignment.confidence >= lag.SURE and abs(late) > LATE:
        ms = f"{abs(late) * 1000:.0f}"
        what = say("The mouth moves {ms} ms too early for the voice.", ms=ms)
        if late > 0:
            what = say("The mouth moves {ms} ms too late for the voice.", ms=ms)
        severity = "major" if abs(late) > VERY_LATE else "minor"
        yield Finding("offset", severity, what, "Press Align to move the motion, or set the offset by hand.")
    moves = bool(len(motion)) and lag.mouth_opening(motion, motion.times).std() > 0.005
    if moves and enough and alignment.confidence < lag.SURE and alignment.correlation < 0.15:
        remedy = "Check that sound and motion are of the same recording."
        yield Finding("mouth", "major", "The mouth does not follow the voice.", remedy)


def _stopped(motion: Motion) -> int:
    """Frames that a sender's clock counts as lost while it sent none for long: a gap, told as such."""
    steps = np.diff(motion.times)
    return round(float(steps[steps > NO_MOTION_S].sum()) * motion.fps)


def _recording(info: TakeInfo, stopped: int) -> Iterator[Finding]:
    """What the recorder counted, and what of its journal could not be read.

    Args:
        info: of the take.
        stopped: frames that are missing because the motion stopped, not because they were lost.
    """
    if damage := info.extra.get("damage", ""):
        # Said at every check: the sentence at the recovery passes, and the take looks like any other.
        remedy = "The damaged file is kept in the take's folder; listen to the place before you train on it."
        yield Finding("journal", "minor", damage, remedy)
    lost = max(info.frames_lost - stopped, 0)
    part = lost / max(info.frames + lost, 1)
    if part > 0.001:
        what = say("Lost {frames} of motion ({part}).", frames=counted(lost, "frame"), part=f"{part:.1%}")
        remedy = "Use a cable or the same computer, and close other programs while recording."
        yield Finding("lost", "major" if part > 0.02 else "minor", what, remedy)
    dropped = info.extra.get("packets_lost", "")
    if dropped.isdigit() and int(dropped) > 0.001 * max(info.packets, 1):
        what = say(
            "This computer was too busy for {packets} of motion.", packets=counted(int(dropped), "packet")
        )
        remedy = "Close other programs while recording, or let the sender bundle its messages."
        yield Finding("dropped", "minor", what, remedy)
    if info.packets_bad > 0.001 * max(info.packets, 1):
        what = say("Could not understand {packets}.", packets=counted(info.packets_bad, "packet"))
        yield Finding("packets", "minor", what, "Check that only one program sends motion to this port.")
    if abs(info.drift_ppm) > 500:
        what = say(
            "The clocks of sound and motion drift by {drift} parts in a million.",
            drift=f"{info.drift_ppm:.0f}",
        )
        severity = "major" if abs(info.drift_ppm) > 5000 else "note"
        yield Finding("drift", severity, what, "It was corrected; use one computer for both if it shows.")
    late = info.extra.get("late", "")
    if late.isdigit() and int(late) > 0.01 * max(info.frames, 1):
        what = say("The motion paused {n} times.", n=late)
        remedy = "Close other programs where the motion comes from, and use a cable instead of Wi-Fi."
        yield Finding("late", "minor", what, remedy)


def _made_from(source: str) -> str:
    """What was brought in, "film" or "sound"; "" for what was recorded here."""
    return "film" if source == "imported (video)" else "sound" if source.startswith("imported") else ""


def _explained(info: TakeInfo) -> tuple[tuple[float, float, str], ...]:
    """Spans that are left out for a reason which is told as such: that motion stopped is yet to be."""
    return tuple(span for span in info.left_out if span[2] != NO_MOTION)


def _merged(spans: tuple[tuple[float, float, str], ...]) -> list[tuple[float, float]]:
    """Spans in order, those that touch joined: a lost face begins and ends with a cut."""
    joined: list[tuple[float, float]] = []
    for start, end, _ in sorted(spans):
        if joined and start <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(joined[-1][1], end))
        else:
            joined.append((start, end))
    return joined


def _graded(report: Report, findings: list[Finding]) -> Report:
    # First that motion ended: what else is wrong of a take cut short is of less matter, and often its cause.
    findings = sorted(findings, key=lambda f: (-SEVERITIES.index(f.severity), f.kind != "ends", f.at or 0.0))
    count = {severity: sum(f.severity == severity for f in findings) for severity in SEVERITIES}
    # Each major fault spoils a part; three of them leave too little to be worth a look.
    # An end is left out, and the rest of the take may be as good as any.
    spoilt = sum(f.severity == "major" and f.kind != "ends" for f in findings)
    if count["fatal"] or spoilt >= 3:
        grade = "D"
    elif count["major"]:
        grade = "C"
    else:
        grade = "B" if count["minor"] else "A"
    # A note is no fault: a take with notes alone is still "nothing to mend".
    worst = findings[0] if findings and findings[0].severity != "note" else None
    reason = worst.what if worst else "No problems found."
    return replace(report, grade=grade, reason=reason, findings=tuple(findings))


def _clock(seconds: float) -> str:
    """Minutes and seconds, as 0:06."""
    return f"{round(seconds) // 60}:{round(seconds) % 60:02d}"
