"""The Review tab: predicted and captured motion in time with sound, tuned, sent and exported.

batch_presenter      Presenter of the batch dialog: one batch in a child process, followed through its queue
batch_view           The batch dialog: which sounds or takes, by which run, as which formats, and the queue
clip                 What can be reviewed: how an item is read, and its motions tuned. No widgets
export_options_view  What an export asks besides formats and name: part, span, frame rate, pictures
export_presenter     Presenter of the Export panel: writes what is shown through a child process
export_view          The Export panel: which formats, where to, and the outcome
model                State of the tab: what can be reviewed and what is on the stage, with signals of its
                     changes
moods_presenter      Presenter of the moods: paints them over the sound, and has the motion made anew
moods_view           Moods over the timeline: which one is painted, how strong each is, and a mix of styles
preset_presenter     Presenter of the tuning presets: in the project's folder, and in files to share
presenter            The Review tab: builds its model and its cards
run_presenter        Presenter of the bar over the stage: which runs are seen, and the motions they make
run_view             The bar over the stage: a run and its style, a second one, the switch, and the blind
                     vote
send_presenter       Presenter of the Send panel: one VMC target per row, and how each one is
sources_presenter    Presenter of the list of what can be reviewed: sounds are added and removed, takes chosen
sources_view         The list of what can be reviewed, with what is added and removed
stage_presenter      Draws what the stage shows: figures, faces, curves, heat and the comparison's figures
stage_view           The stage: two panes that share a camera, its views and turntable, and the face's meters
style_presenter      Presenter of "Move like this": a run is shown a style by some seconds of a take
transport_presenter  Plays, seeks, steps and loops, and brings the picture to where the sound is
tune_controls        What the Tune panel is built of: numbers with sliders, folds, and special folds
tune_presenter       Presenter of the Tune panel: lays its sliders over the motions, and remembers them
tune_view            The Tune panel: layers over the motion, with their presets and undo
view                 The layout of the tab: list, stage, timeline with transport, and the panels
vote_presenter       The blind vote between two runs, and the file of its answers
"""
