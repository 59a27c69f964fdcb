"""One thing and several, each with its sentence."""

import pytest

from studio.ui.plural import counted


@pytest.mark.parametrize(
    ("count", "said"), [(0, "0 labels in a.txt."), (1, "1 label in a.txt."), (2, "2 labels in a.txt.")]
)
def test_one_and_several_have_their_own_sentence(count: int, said: str) -> None:
    assert counted(count, "1 label in {1}.", "{0} labels in {1}.", "a.txt") == said
