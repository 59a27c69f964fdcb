"""Labels go to Audacity and Praat and come back the same; what makes no sense is one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from praatio import textgrid

from studio.dataset import Label
from studio.dataset.label_files import read_labels, write_labels
from studio.errors import RequestError, StudioError

LABELS = (
    Label(0.5, 1.25, "sentence", "こんにちは: hello"),
    Label(0.5, 2.0, "emotion", "happy"),
    Label(1.0, 0.5, "emotion", "shy"),
    Label(1.5, 0.0, "gesture", "nod"),
    Label(3.0, 1.0, "sentence", "emotion: is a word"),
)
AGAIN = "Export the labels again, as an Audacity label track (.txt) or a Praat TextGrid."


@pytest.mark.parametrize("name", ["声 1.txt", "声 1.TextGrid"])
def test_labels_come_back_as_they_were(tmp_path: Path, name: str) -> None:
    write_labels(tmp_path / name, reversed(LABELS), 6.0)
    assert set(read_labels(tmp_path / name)) == set(LABELS)


def test_an_audacity_file_is_what_audacity_writes(tmp_path: Path) -> None:
    write_labels(tmp_path / "a.txt", LABELS[1:2], 6.0)
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "0.500000\t2.500000\temotion: happy\n"


def test_praats_own_reader_opens_our_textgrid(tmp_path: Path) -> None:
    write_labels(tmp_path / "a.TextGrid", LABELS, 6.0)
    grid = textgrid.openTextgrid(str(tmp_path / "a.TextGrid"), includeEmptyIntervals=False)
    assert grid.tierNames == ("sentence", "emotion", "emotion (2)", "gesture (points)")
    assert grid.maxTimestamp == 6.0
    assert [tuple(one) for one in grid.getTier("emotion").entries] == [(0.5, 2.5, "happy")]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp932"])
def test_labels_of_any_usual_encoding_with_decimal_commas_are_read(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes("1,5\t2,0\tうなずき\r\n\\\t100\t200\r\n2,5\t2,5\t\r\n".encode(encoding))
    assert read_labels(path, "gesture") == (
        Label(1.5, 0.5, "gesture", "うなずき"),
        Label(2.5, 0, "gesture", ""),
    )


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("a.txt", b"", "a.txt is empty."),
        ("a.txt", b"1.0\t2.0\tok\nhello", "Line 2 of a.txt is not a label: 'hello'."),
        ("a.txt", b"nan\t2.0\tx", "Line 1 of a.txt is not a label: 'nan\\t2.0\\tx'."),
        ("a.txt", b"\x81\xff\xff", "a.txt has an unknown text encoding."),
        ("a.txt", b"\\\t1\t2", "There are no labels in a.txt."),
        ("a.TextGrid", b"1\t2\thello", "a.TextGrid is not a TextGrid."),
        ("a.TextGrid", b'File type = "ooTextFile"\nObject', "a.TextGrid is damaged or was cut short."),
        ("a.TextGrid", b'{"tiers": 3}', "a.TextGrid is damaged or was cut short."),
    ],
)
def test_a_bad_file_is_one_sentence(tmp_path: Path, name: str, content: bytes, what: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(StudioError) as error:
        read_labels(tmp_path / name)
    assert (error.value.what, error.value.remedy) == (what, AGAIN)


def test_a_textgrid_cut_anywhere_is_read_or_refused_in_words(tmp_path: Path) -> None:
    path = tmp_path / "a.TextGrid"
    write_labels(path, LABELS, 6.0)
    whole = path.read_bytes()
    for length in range(1, len(whole), 17):
        path.write_bytes(whole[:length])
        try:
            found = read_labels(path)
        except StudioError:
            continue
        assert len(found) <= len(LABELS)


def test_other_suffixes_and_no_labels_are_refused(tmp_path: Path) -> None:
    remedy = "Choose a name that ends in .txt (Audacity) or .TextGrid (Praat)."
    for call in (lambda: read_labels(Path("a.eaf")), lambda: write_labels(Path("a.eaf"), LABELS, 1.0)):
        with pytest.raises(RequestError) as error:
            call()
        assert str(error.value.what) == "a.eaf is not a label file that is known here."
        assert error.value.remedy == remedy
    with pytest.raises(RequestError) as none:
        write_labels(tmp_path / "a.txt", (), 1.0)
    assert none.value.what == "There are no labels to export."


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.builds(
            Label,
            st.integers(0, 600).map(lambda n: n / 10),
            st.integers(0, 50).map(lambda n: n / 10),
            st.sampled_from(("sentence", "emotion", "gesture")),
            st.sampled_from(('say "it"', "はい", "a: b", "gesture: x", "xmin = 1")),
        ),
        min_size=1,
        max_size=12,
        unique=True,
    ),
    st.sampled_from((".txt", ".TextGrid")),
)
def test_any_labels_survive(
    tmp_path_factory: pytest.TempPathFactory, labels: list[Label], suffix: str
) -> None:
    path = tmp_path_factory.mktemp("labels") / f"a{suffix}"
    write_labels(path, labels, 60.0)

    def rounded(some: list[Label]) -> list[Label]:
        clean = (Label(round(x.t, 4), round(x.duration, 4), x.tier, x.text) for x in some)
        return sorted(clean, key=lambda x: (x.t, x.duration, x.tier, x.text))

    assert rounded(list(read_labels(path))) == rounded(labels)
