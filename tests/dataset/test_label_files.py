"""Labels go to Audacity and Praat and come back the same; what makes no sense is one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from praatio import textgrid

from studio.dataset import Label
from studio.dataset.label_files import TIERS, outside, read_labels, vocabularies, write_labels
from studio.errors import RequestError, StudioError

LABELS = (
    Label(0.5, 1.25, "sentence", "こんにちは: hello"),
    Label(0.5, 2.0, "emotion", "happy"),
    Label(1.0, 0.5, "emotion", "shy"),
    Label(1.5, 0.0, "gesture", "nod"),
    Label(3.0, 1.0, "sentence", "emotion: is a word"),
)
AGAIN = "Export the labels again, as an Audacity label track (.txt), a Praat TextGrid or an ELAN .eaf."


@pytest.mark.parametrize("name", ["声 1.txt", "声 1.TextGrid", "声 1.eaf"])
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
    remedy = "Choose a name that ends in .txt (Audacity), .TextGrid (Praat) or .eaf (ELAN)."
    for call in (lambda: read_labels(Path("a.srt")), lambda: write_labels(Path("a.srt"), LABELS, 1.0)):
        with pytest.raises(RequestError) as error:
            call()
        assert str(error.value.what) == "The studio cannot read a.srt as a label file."
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


def test_elans_own_reader_opens_our_document(tmp_path: Path) -> None:
    from pympi.Elan import Eaf

    write_labels(tmp_path / "a.eaf", LABELS, 6.0)
    document = Eaf(str(tmp_path / "a.eaf"))
    assert set(document.get_tier_names()) == {"sentence", "emotion", "emotion (2)", "gesture (points)"}
    assert document.get_annotation_data_for_tier("emotion") == [(500, 2500, "happy")]
    ((start, end, text),) = document.get_annotation_data_for_tier("gesture (points)")
    assert (start, text) == (1500, "nod")
    assert end > start


EAF = """<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" DATE="2020-01-01T00:00:00+00:00" FORMAT="3.0" VERSION="3.0"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:noNamespaceSchemaLocation="http://www.mpi.nl/tools/elan/EAFv3.0.xsd">
<HEADER MEDIA_FILE="" TIME_UNITS="milliseconds"/>
<TIME_ORDER><TIME_SLOT TIME_SLOT_ID="ts1" TIME_VALUE="0"/><TIME_SLOT TIME_SLOT_ID="ts2"/>
<TIME_SLOT TIME_SLOT_ID="ts3" TIME_VALUE="1000"/></TIME_ORDER>
<TIER LINGUISTIC_TYPE_REF="t" TIER_ID="words">
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a1" TIME_SLOT_REF1="ts1" TIME_SLOT_REF2="ts2">
<ANNOTATION_VALUE>手</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a2" TIME_SLOT_REF1="ts2" TIME_SLOT_REF2="ts3">
<ANNOTATION_VALUE/></ALIGNABLE_ANNOTATION></ANNOTATION></TIER>
<TIER LINGUISTIC_TYPE_REF="t" PARENT_REF="words" TIER_ID="gloss">
<ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a3" ANNOTATION_REF="a1">
<ANNOTATION_VALUE>hand</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION></TIER>
<LINGUISTIC_TYPE LINGUISTIC_TYPE_ID="t" TIME_ALIGNABLE="true"/>
</ANNOTATION_DOCUMENT>"""


TYPED = EAF.replace("<ANNOTATION_DOCUMENT", '<!DOCTYPE x [<!ENTITY a "b">]>\n<ANNOTATION_DOCUMENT')


def test_what_elan_leaves_out_is_worked_out(tmp_path: Path) -> None:
    """A slot without a time stands between its neighbours; a reference has the span of what it refers to."""
    (tmp_path / "a.eaf").write_text(EAF, encoding="utf-8")
    assert set(read_labels(tmp_path / "a.eaf")) == {
        Label(0.0, 0.5, "words", "手"),
        Label(0.5, 0.5, "words", ""),
        Label(0.0, 0.5, "gloss", "hand"),
    }


@pytest.mark.parametrize(
    "content",
    [
        b"nonsense",
        b"<html></html>",
        EAF[:900].encode(),
        EAF.replace('ANNOTATION_REF="a1"', 'ANNOTATION_REF="a3"').encode(),
        EAF.replace(' TIME_VALUE="0"', "").replace(' TIME_VALUE="1000"', "").encode(),
        TYPED.encode(),
        TYPED.replace("<!DOCTYPE", f"<!-- {'x' * 70_000} --><!DOCTYPE").encode(),
        TYPED.replace("UTF-8", "UTF-16").encode("utf-16"),
        TYPED.replace("UTF-8", "ISO-8859-1").encode("latin-1", "xmlcharrefreplace"),
    ],
)
def test_a_damaged_elan_document_is_one_sentence(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.eaf").write_bytes(content)
    with pytest.raises(StudioError) as error:
        read_labels(tmp_path / "a.eaf")
    assert (error.value.what, error.value.remedy) == ("a.eaf is no ELAN document, or damaged.", AGAIN)


def test_labels_outside_of_the_used_part_are_counted() -> None:
    assert outside(LABELS, 0.0, 6.0) == 0
    assert outside(LABELS, 1.6, 2.9) == 3


def test_each_language_has_words_for_every_tier_that_fit_the_keys() -> None:
    assert {one.language for one in vocabularies()} == {"en", "ja"}
    for one in vocabularies():
        assert [tier for tier, _ in one.words] == list(TIERS), one.name
        for tier, words in one.words:
            assert 1 <= len(words) <= 9, (one.name, tier)
            assert len(set(words)) == len(words), (one.name, tier)
            assert all(word == word.strip() and "=" not in word for word in words)


def test_entries_are_what_settings_keep() -> None:
    acting = next(one for one in vocabularies() if one.name == "acting_ja")
    assert acting.title == "演技（日本語）"
    assert "emotion=うれしい" in acting.entries
