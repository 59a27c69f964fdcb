"""Live: speak, and the avatar moves now.

controls      Mute, freeze and the neutral pose: three switches with keys, for what must happen at once
latency_card  How late the avatar is, what viewers make of it, what to type into OBS, and the look-ahead
              slider
performing    The child process that performs: begun, spoken to, and ended, by force where it does not end
              by itself
presenter     Live: thought, no layout. A child process performs; this starts it, talks to it, shows what it
              says
sounds        What is heard: the microphones there are, the one chosen, and a sound file in their place
source_card   Who performs and what is heard: a run, its style and layers, a microphone or a file, and Start
stage         The stage of Live: the performer as it is sent, a stick figure or the performer's own avatar
standing      The sentence under the avatar: how the performance stands, and what to do where it does not
              move
state         What the child that performs says of itself, as plain values. No widgets
targets       The Send panel in the Live tab: which targets the child sends to, and how each does
tunings       The presets of Review's Tune panel that Live can lay over the motion
view          The Live tab: who performs, the avatar as it is sent, where it is sent to, and how late it is
voice         Who gets the voice as late as the avatar: headphones, or a cable that the streaming program
              listens to
wishes        Switches that were just pressed: what the child told of itself before it heard must not press
              them back
"""
