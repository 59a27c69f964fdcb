"""What went wrong and what to do, together and apart."""

import copy
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import pytest

from studio.errors import Cancelled, FileThereError, RequestError, StudioError, port_taken, say
from studio.training.recipe import UnusableRunError


def test_an_error_reads_as_two_sentences() -> None:
    error = StudioError("Port 39539 is in use.", "Choose another port.")
    assert str(error) == "Port 39539 is in use. Choose another port."
    assert (error.what, error.remedy) == ("Port 39539 is in use.", "Choose another port.")


def test_a_wrong_request_is_a_studio_error() -> None:
    assert issubclass(RequestError, StudioError)


ERRORS = (
    StudioError("The disk is full.", "Free some space.", code="full", in_window="Free some."),
    port_taken(39_539),
    FileThereError("There is a take.", "Choose another name.", "take.wav"),
    Cancelled(),
    UnusableRunError("balanced_001", say("Its rate is {rate}.", rate=0)),
)


def _fail(error: StudioError) -> None:
    error.add_note("on the way")
    raise error


@pytest.mark.parametrize("error", ERRORS, ids=lambda one: type(one).__name__)
def test_an_error_is_whole_when_it_was_pickled_or_copied(error: StudioError) -> None:
    protocols = range(pickle.HIGHEST_PROTOCOL + 1)
    again = [*(pickle.loads(pickle.dumps(error, one)) for one in protocols), copy.copy(error)]
    for one in again:
        assert type(one) is type(error)
        assert (str(one), vars(one), one.code) == (str(error), vars(error), error.code)
        assert one.what.template == error.what.template


def test_the_sentence_of_another_process_comes_home() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool, pytest.raises(RequestError) as raised:
        pool.submit(_fail, ERRORS[2]).result()
    assert (str(raised.value), raised.value.file) == (str(ERRORS[2]), "take.wav")
