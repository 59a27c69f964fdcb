"""Live: a microphone in, a trained run's motion out over VMC, now.

audio_source   Audio sources of a live performance: a microphone that reconnects by itself, or a sound file
build          Builds a live performance from a run, and the switches to change while it runs (torch)
delayed_voice  Plays the voice on a sound output with the avatar's delay, despite two sound cards' clocks
early_opening  Opens the mouth as soon as a voice begins, before the network can know which sound it will be
last_minutes   The last minutes of a performance, sound and sent motion, to keep as a take
performance    The live pipeline: sound of a source in, the pose to send at each moment out (torch)
pose_layers    Layers over a model's live poses: idle motion, freezing, the neutral pose, a tuning
preprocess     Preprocessing of live sound: resampling, noise suppression, speech gate, automatic gain
steps          Streaming inference: poses as soon as their sound is there; which look-aheads there are, and
               the usual one (torch)
timing         Timing of live poses: sample clock, adaptive delay, and a buffer interpolated between poses
"""
