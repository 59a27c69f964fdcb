"""Takes and generated motion as files of other programs: what the Export panel and the commands share.

clip     What is exported: a take's used part, a motion file, or what a run makes of a sound
options  Which formats, how pictures are drawn, and which files may be written
queue    Files made one after another: what fails is reported, and the others go on
range    Which part of a motion and its sound is written: face or body, seconds, frame rate, layers
"""
