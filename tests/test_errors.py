"""What went wrong and what to do, together and apart."""

from studio.errors import RequestError, StudioError


def test_an_error_reads_as_two_sentences() -> None:
    error = StudioError("Port 39539 is in use.", "Choose another port.")
    assert str(error) == "Port 39539 is in use. Choose another port."
    assert (error.what, error.remedy) == ("Port 39539 is in use.", "Choose another port.")


def test_a_wrong_request_is_a_studio_error() -> None:
    assert issubclass(RequestError, StudioError)
