"""Motion and sound against one clock.

layers/       What is laid over a motion without changing it: strength, smoothing, blinks, gaze, breath,
              masks, feet
lip_sync      What people notice between sound and lips, and how much to delay the sound so that nobody does
player        The player: one position that everything on screen and on the wire follows
sound_output  Sound output device, and the file position that is audible right now
transport     The transport's state machine as a table of (state, event) to the next state
"""
