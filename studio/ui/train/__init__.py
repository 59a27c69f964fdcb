"""The Train tab: data, presets, curves, runs.

advanced        Train's advanced drawer: a recipe's forms, look-ahead, epochs, seed, and what to compute on
card_dialog     The model card of a run, with the note on licence and consent that a person writes
carrying        A run's model card, and the run as one file: out to another computer, and in from there
choices         What to train: a preset card or a recipe, and what there is to compute on
compare_dialog  The window that holds runs against each other: figures, bars and curves
compare_facts   What `saia compare` found, as rows to show: which figure, in whose favour. Pure: no Qt
                widgets
compare_table   The table of a comparison: a figure a row, a run a column, each number over its bar
comparing       Measures runs side by side in a child process, and shows what it found
data_card       The data card of Train: how much there is to learn from, and what is wrong about it
data_facts      What there is to train on, counted, with what is wrong about it in words. Pure: no Qt
                widgets
ending          The question before the window closes on a training
following       Shows a run's curves, figures and preview: of the training under way, or of one in the list
heard           What the training child has said so far. Pure: no Qt widgets
presenter       What the Train tab does: counts the data, starts and follows the training child, keeps the
                runs
preset_card     A preset to choose: its name, how long it takes, and what it is for
preview_pane    What a model has learnt, to be seen: a few seconds of a validation take, captured and
                predicted
previewing      Keeps the preview of the shown run up to date: reads what the training child wrote
progress_card   The progress card of Train: curves, time left, the still-model alarm and the log of one run
removing        Runs that are removed or brought in, as steps of undo: into the project's trash and back
run_facts       What a run did, read from its epochs: best epoch, time left, whether it moves. Pure: no Qt
                widgets
run_keeping     The list of runs, and what is done with them: review, compare, note, show, take along,
                delete
run_reading     Runs as they lie on the disk, read again only where something changed. Pure: no Qt
runs_table      The list of training runs with their figures and notes
view            The Train tab: what there is to learn from, which preset, the curves while it learns, and
                all runs
words           What is said of a training under way, and of one that is over. Pure: no widgets
"""
