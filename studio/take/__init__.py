"""One recording: sound and motion under one clock, never altered once saved."""

from studio.take.take import Take, TakeInfo

__all__ = ["Take", "TakeInfo"]
