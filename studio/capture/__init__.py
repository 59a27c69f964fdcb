"""Recording: microphone and motion under one clock, into a take that survives a kill.

cut_off           Takes that ended early by a fault: the cause, what could be saved, and where it is
folder_watch      Tracks the open files of a take being recorded, even if their folder is moved or deleted
health            Problems of a running capture as sentences, each with a remedy. Pure
input_tests       Tests before a recording: the microphone's level, and the offset between voice and motion.
                  Pure
inputs            The recorder's motion and sound inputs, polled by its thread: rows, blocks, statistics,
                  clock fit
journal           Writer of a take's crash-safe journal: blocks with checksums, each readable without the
                  others
journal_contents  Reader of a take's journal: resynchronises after damage, collects rows and lists what is
                  missing
journal_format    The blocks a journal is made of: marks, headers and checksums that its writer and its
                  reader share
listener          The process that receives motion, so that nothing the window does can make it miss a
                  packet
microphone        Sound in: blocks as the device gives them, each with its moment; a device that vanished is
                  opened again
priority          Raises the scheduling priority of this process, as far as its user is allowed to
receiver          Receives motion on UDP ports: datagrams of all senders decoded into rows, with statistics
recorder          The recorder: opens inputs, keeps a pre-roll, and records and saves takes
recovery          Crash recovery: takes made from the journals that a killed program left behind
roll              One recording in progress, on the disk from its first moment, and how it becomes a take
snapshot          The state of a capture at one moment as frozen values, polled by displays
snapshot_builder  Builds a Snapshot from a recorder's inputs and counters; changes nothing
"""
