"""A trained run at work: from a sound file (offline), or from the microphone, now (live/) (torch).

live/    Live: a microphone in, a trained run's motion out over VMC, now
offline  Offline inference: motion of a sound of any length by a trained run, in bounded memory (torch)
"""
