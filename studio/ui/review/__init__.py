"""The Review tab: predicted and captured motion in time with sound, sending, exporting.

batch_dialog    Many sounds or takes at once: what, by which run, as which formats, where to, and how far it
                is
batching        A batch in a child process: starts it, follows its queue, and asks before files are written
                over
camera          More views of the figures, and a camera that goes around them by itself
clip            What Review has on its stage: a sound, what was captured with it, and what a run made of it.
                No widgets
export_options  What else an export asks: further formats, part, span, sliders, and how pictures are drawn
export_panel    Exporting: which format, what it leaves out, how many frames a second, and where to
exporting       Writes what is on screen through a child process, and says so only once it was read back
last_tuning     Keeps where Tune's sliders stand with the project: the next start begins where the last one
                ended
listing         Review's lists: what can be reviewed, and the runs that can generate
making          The motions on Review's stage: asked of one run or two, tuned, and switched between
pair_meters     Blend-shape meters: a bar for the predicted value, a mark for the captured one; the
                liveliest first
playing         Review's transport: plays, seeks, steps and loops, and brings the picture to where the sound
                is
predicting      The motion a run makes of a sound: read where it was made before, else made by a child
                process
presenter       What the Review tab does: loads, generates, tunes, and keeps playing, sending and exporting
                in step
preset_bar      The presets of the Tune panel: choose one, keep what is tuned under a name, take it to
                another project
run_bar         The bar over Review's stage: which run and style, a second one, the switch, and the blind
                vote
scene           What is on Review's stage: one sound, what was captured with it, and what one or two runs
                made of it
sending         Keeps one VMC target per row of the Send panel running, and its light right
showing         Draws the scene: figures, faces, curves, heat and the figures of the comparison
sounds          Sounds of a project that are no takes: what was dropped on Review, kept until it is removed.
                No widgets
source_card     The list of what can be reviewed: dropped sounds and takes
stage           The stage: captured and predicted side by side or one over the other, each with a face
tune_fields     A number with a slider, and a fold that holds some of them: what the Tune panel is built of
tune_folds      The folds of the Tune panel that hold more than sliders: single shapes, and what moves
tune_panel      Layers over the motion: seen, sent and exported as they stand here
tunings         Keeps the Tune panel's presets: in the project's folder, and in files that people send each
                other
view            The Review tab: sources, the stage, the timeline with its transport, and tune, send and
                export
vote_bar        Switches between two runs and asks which is better, without saying which is which
votes           Blind votes between runs, kept with the project's runs, one JSON line each. No widgets
voting          The blind vote: chance decides the order, the answer is kept, and only then the names are
                told
"""
