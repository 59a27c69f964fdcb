"""Saia Studio: one person's voice, turned into their own motion.

Data flows one way, and the folders are its stations. Core folders are nouns (what flows); tabs and
commands are verbs (what you do).

    errors          say("a sentence with {fields}"); StudioError(what happened, what to do)
    paths           where the studio's own files lie
    registry        one file = one entry (verbs, formats, models), listed without importing
    settings        preferences as fields: default, limits, unit, help
    actions         what can be done, declared once: name, keys, where it works, what it needs
    launch          how programs are started, and that no code comes from the current folder
    clock           one clock for every input, and how the sound device's runs beside it
    virtual_devices a screen and a sound device where the machine has none (tests, tour)
    files/          files that are whole or absent: atomic writes, locks, leftovers, the one cache
    ipc/            what the window and its child processes say to one another
    motion/         what moves; the one word everyone shares (numpy only)
    sound/          sound files, rates, levels, speech, and pictures of them
    vmc/            VMC over UDP, both directions: datagrams to frames, poses to programs
    tracking/       a face in pictures, as motion: a webcam or any video in place of a tracker
    capture/        microphone and motion under one clock, into a take that survives a kill
    take/           one recording; never altered once saved
    dataset/        takes chosen and marked for training
    project/        the open folder: dataset, takes, runs, and the zip to take it elsewhere
    features/       numbers a model can eat
    model/          networks, one file each (torch)
    training/       recipe and events (no torch); loop/, losses, checkpoint (torch)
    metrics/        every figure about motion (numpy only)
    evaluation/     a run measured on takes, beside the guesses it has to beat
    inference/      a run at work: offline, and live/ from the microphone, now (torch)
    playback/       motion and sound against one clock, and what is laid over a motion
    render/         a performer as a picture: figure or avatar, off screen; the window and films share it
    formats/        importers and exporters, one file each
    export/         clip, range, options, queue: what the Export panel and the commands share
    remote/         Live and the programs of a stream: Stream Deck and its like, OBS
    performer/      the practice performer: a voice and VMC motion without hardware
    cli/            parse, call, print; one file per verb, listed without importing
    ui/             the only Qt in the house
    __main__        no command opens the window; a command goes to cli
"""

__version__ = "0.1.0"
