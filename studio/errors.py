"""The one way the studio says that something went wrong."""


class StudioError(Exception):
    """Something a person can act on.

    Args:
        what: one sentence naming the thing that happened.
        remedy: one sentence saying what to do about it.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what} {remedy}")
        self.what = what
        self.remedy = remedy


class RequestError(StudioError):
    """The request itself was wrong (an unknown take, a bad option): exit code 2 on the command line."""


class FileThereError(RequestError):
    """A file would be written over, which is not done unasked.

    Args:
        what, remedy: the two sentences.
        file: the name of the file.
    """

    def __init__(self, what: str, remedy: str, file: str) -> None:
        super().__init__(what, remedy)
        self.file = file
