"""Recording: microphone and motion under one clock, into a take that survives a kill.

Motion flows from `listener` (a process of its own, around `receiver`) through `inputs` to the `recorder`,
which hands it and the microphone's blocks to a `roll`; `recovery` makes a take of it.

cut_off           Saves every roll that ended, and notices takes that ended early by a fault: how a lost
                  folder is noticed, the cause, and what could be saved
device_names      Names of sound devices as people know them, and those of the list that are none
health            Problems of a running capture as sentences, each with a remedy. Pure
input_tests       Tests before a recording: the microphone's level, and the offset between voice and motion.
                  Pure
inputs            The recorder's motion and sound inputs, polled by its thread: rows, blocks, statistics,
                  clock fit
journal           Writer of a take's crash-safe journal, and the blocks it is made of: each readable without
                  the others
journal_contents  Reader of a take's journal: resynchronises after damage, collects rows and lists what is
                  missing
listener          The process that receives motion, so that nothing the window does can make it miss a
                  packet
microphone        Sound in: blocks as the device gives them, each with its moment; a device that vanished is
                  opened again
phrase            One phrase spoken into a microphone, up to a pause: heard and forgotten, no take
practice_voice    The practice performer as a microphone: its voice over a voice line, silence while it says
                  nothing
receiver          Receives motion on UDP ports: datagrams of all senders decoded into rows, with statistics
recorder          The recorder: opens inputs, keeps a pre-roll, and records and saves takes
recovery          Takes made from journals: when a recording ends, and after a program that was killed while
                  it recorded
roll              One recording in progress, on the disk from its first moment
snapshot          The state of a capture at one moment as frozen values, and how it is built from the
                  recorder's inputs
trackers          Trackers that people have: their port, how each is made to send, and which one a sender is
"""
