"""Motion and sound against one clock.

layers/       What is laid over a motion without changing it: strength, smoothing, blinks, gaze, breath,
              masks, feet
player        The player: one position that everything on screen and on the wire follows, and its transport
sound_output  Sound output device, the file position that is audible right now, and what people notice of
              its sync
"""
