"""Live: a microphone in, a trained run's motion out over VMC, now.

sources         a microphone that comes back by itself, or a file that is performed
resample        sound at any rate -> the model's rate, within two milliseconds
moments         which moment a sample was captured at; how late motion must be shown to be even
gate            whether somebody speaks (causal)
gain            the microphone brought to the level of the training takes
conditioning    these together: sound made fit for a model
steps           sound -> feature rows -> the network with carried state, frame by frame (torch)
pose_line       the poses of the last seconds, and the one of any moment
delay_line      sound in with its moments, sound out by its moments, whatever two sound cards' clocks do
handed_on       the voice given to a sound output as late as the avatar is
stand           what is laid over the poses: idling, freezing, the neutral pose, a tuning
performance     all of it together, and the pose to send at each moment (torch)
build           a run made ready to perform (torch)
"""
