"""One recording: sound and motion under one clock, never altered once saved.

alignment    How far sound and motion of a saved take are apart: by mouth and voice, or by claps
check        What is wrong with a take, in words a performer understands, and a grade
cleaned      Sound with less noise: made once from a recording, kept beside it, and used where a person
             chose it
filmed       What a take's pictures were like, as findings: the face in them, and a phone that saw it too
findings     What is wrong with the motion and the sound of a take
folder       Takes on disk: a folder with the sound, the motion and take.json, written once
motion_file  The motion file: one row a frame in Apache Arrow's file format, channels named in its metadata
take         A take: what was recorded, how, where it lies, and what was noticed about it
"""

from studio.take.take import Take, TakeInfo

__all__ = ["Take", "TakeInfo"]
