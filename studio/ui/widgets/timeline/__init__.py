"""The timeline: sound, motion, labels and problems under one playhead.

content     What a timeline shows, as values: curves, marks, label edits, and where its lanes lie. Pure: no Qt
mouse       What lies under the mouse on a timeline, and what it does there from press to release
paint       How a timeline is painted: the lanes, once, into a picture, and what moves above them
sound_lane  How sound is painted into a timeline's lane: as a waveform or a spectrogram, and the colours for
            heat
time_view   Which stretch of time a timeline shows, and where each second falls on it. Pure: no Qt
timeline    The timeline: sound, motion, labels and problems under one playhead; and the field in which a
            label is typed
"""
