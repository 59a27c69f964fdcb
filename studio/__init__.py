"""Saia Studio: one person's voice, turned into their own motion.

Data flows one way, and the folders are its stations. Core folders are nouns (what flows); tabs and
commands are verbs (what you do).

    __main__        no command opens the window; a command goes to cli
    cli/            parse, call, print; one file per verb, listed without importing

    motion/         what moves; the one word everyone shares (numpy only)
    capture/        packets and audio blocks in, under one clock
    take/           one recording; never altered once saved
    dataset/        takes chosen and marked for training
    features/       numbers a model can eat
    model/          networks, one file each (torch)
    training/       recipe and events (no torch); loop, losses, metrics, checkpoint (torch)
    generate        audio + checkpoint -> Motion, any length, in chunks (torch)
    live/           microphone -> model -> VMC, now (torch)
    playback/       motion and sound against one clock; the VMC sender
    picture/        a performer as a picture: figure or avatar, off screen; the window and films share it
    formats/        importers and exporters, one file each

    performer/      the practice performer: a voice and VMC motion without hardware
    project/        the open folder: dataset, takes, runs
    archive         a project as one zip, to take elsewhere
    paths           where the studio's own files lie
    settings        preferences as fields: default, limits, unit, help
    registry        one file = one entry (verbs, formats, models), listed without importing
    stage           a screen and a sound device where the machine has none (tests, tour)
    errors          StudioError(what happened, what to do)
    ui/             the only Qt in the house
"""

__version__ = "0.1.0"
