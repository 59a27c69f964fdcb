"""The Live tab: a run performs what a microphone or a sound file says, now.

avatar_window         The avatar alone in a window without a frame, for OBS to capture
avatar_window_presenter  Presenter of that window: opens it, moves its avatar, remembers how it stood
latency_presenter     Presenters of the latency card and of the delayed voice
latency_view          How late the avatar is, what to type into OBS, the delayed voice, the look-ahead slider
model                 What the tab knows: the performance, its last state, the run and the sound
obs_presenter         Presenter of OBS: its Sync Offset, and going live with the stream
obs_view              OBS in the On stream card, and the dialog that connects it
presenter             Presenter of the tab: builds its model and its cards, asks before it is closed
send_presenter        Presenter of the Send panel: which targets the child sends to
source_presenter      Presenters of the performer card: run and Start; microphones and files; presets
source_view           Who performs and what is heard: a run, its style and layers, a microphone or a file
stage_presenter       Presenters of the stage and of the status under it
stage_view            The performer as it is sent, and mute, freeze and neutral with their keys
stream_presenter      Presenter of remote control: what other programs press is done here
stream_view           On stream: remote control, OBS, and keeping the last minutes
task                  The child process that performs
view                  Layout of the tab
"""
