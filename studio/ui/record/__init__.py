"""The Record tab: capture, meters, health, takes of today.

countdown         Three, two, one
findings          What the health card and the status strip say of a snapshot. Pure: no widgets
health            The health card: in words a performer understands, each with what to do
inputs            The inputs card: where motion and sound come from, and how loud
inputs_presenter  Thought behind the inputs card: devices and ports opened off the GUI thread, one after
                  another
level             The level test beside the microphone: speak as loud as it will get, and know whether it is
                  set well
live_pose         A pose as joints in the world, its skeleton kept as long as the bones stay the same
phone             A phone that sends its face only when asked: asked again and again until it does
phone_row         The row of the inputs card that asks a phone for its face
practice          The practice performer in the window: a child process, steady whatever the window does
presenter         Record: thought, no layout. One timer pulls the recorder's snapshot; everything slow runs
                  elsewhere
slate_bar         Under the figure: slate, take number, time, the one red button, countdown and pre-roll
sync              The sync test beside the offset: a few claps or "pa", and the milliseconds are known for
                  this pair
takes_list        The takes of today: hear, keep, do again, note
takes_presenter   Thought behind the takes of today: heard again with the figure moving, kept, noted, thrown
                  away
view              Record: layout and signals, no thought
"""
