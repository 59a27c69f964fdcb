"""The Train tab: data, presets, curves, runs.

card_view           The model card of a run, with the note on licence and consent that a person writes
compare_presenter   Measures runs side by side in a child process, and shows what it found
compare_view        The window that holds runs against each other: a table of figures with bars, and curves
data_facts          What there is to train on, counted, with what is wrong about it in words. Pure: no Qt
                    widgets
data_view           The data card: how much there is to learn from, and what is wrong about it
model               What the Train tab knows: the data, the training under way, the run shown, and word of
                    what changed
presenter           The Train tab: its model, its cards, and what it tells people in words
preview_view        What a model has learnt, to be seen: a few seconds of a validation take, captured and
                    predicted
progress_presenter  Shows a run's curves, figures and preview: of the training under way, or of one in the
                    list
progress_view       The progress card: curves, time left, the still-model alarm and the log of one run; and
                    the question before the window closes on a training
recipe_presenter    What to train on and how: the data counted, a preset or recipe, and what there is to
                    compute on
recipe_view         What to train: preset cards, and the drawer with other recipes and what may be changed
                    of one
run_facts           What a run did, read from its epochs, and the runs as they lie on the disk. Pure: no Qt
                    widgets
run_trash           Runs that are removed or brought in, as steps of undo: into the project's trash and back
runs_presenter      The list of runs, and what is done with one of them: review, resume, note, show its
                    folder, delete
runs_view           The list of training runs with their verdicts and notes, and what can be done with them
task                The training under way: a child process, the run it makes, how far it is, and how that
                    is said
transfer_presenter  A run's model card, and the run as one file: out to another computer, and in from there
verdict_presenter   Says how good the shown run is, and measures in a child process what more takes would
                    bring
verdict_view        The verdict on the shown run, and the button that measures what more takes would bring
view                The tab's cards, and what is seen in their place before there is anything to learn from
"""
