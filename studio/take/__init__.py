"""One recording: sound and motion under one clock, never altered once saved.

check         What is wrong with a take, in words a performer understands, and a grade
check_motion  What is wrong with the motion of a take
check_sound   What is wrong with the sound of a take
clap          How far sound and motion are apart by claps: where the hands meet, against where the sound
              jumps up
cleaned       Sound with less noise: made once from a recording, kept beside it, and used where a person
              chose it
folder        Takes on disk: a folder with the sound, the motion and take.json, written once
motion_file   The motion file: one row a frame in Apache Arrow's file format, channels named in its metadata
take          A take: what was recorded, how, where it lies, and what was noticed about it
"""

from studio.take.take import Take, TakeInfo

__all__ = ["Take", "TakeInfo"]
