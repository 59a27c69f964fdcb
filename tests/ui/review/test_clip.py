from __future__ import annotations

from dataclasses import replace

from studio.dataset import edits
from studio.project import Project
from studio.take import kept
from studio.ui.review.clip import sources


def test_a_take_is_heard_cleaned_where_that_is_chosen_and_made(toy_project: Project) -> None:
    def heard(name: str) -> str:
        sound = next(one.sound for one in sources(toy_project, {}) if one.title == name)
        assert sound is not None
        return sound.name

    change = edits.update(toy_project.dataset, ["toy_001"], lambda s: replace(s, clean="voice"))
    toy_project.edit("Clean", change)
    assert heard("toy_001") == "audio.wav", "not made yet: the recording"
    recorded = toy_project.take("toy_001").audio_path
    assert recorded is not None
    with kept.keeping(recorded, "clean1-voice.flac") as beside:
        beside.write_bytes(b"made")
    assert heard("toy_001").startswith("clean1-voice")
    assert heard("toy_002") == "audio.wav"
