"""The Curate tab: the library, the timeline, trims, offsets and labels.

aligning_presenter       Sound and motion brought into step: found by itself with a confidence, or nudged in
                         milliseconds
aligning_view            What aligning found: one take with its curve in full, or many in a table to judge
                         one by one
bench_presenter          The take shown, heard and seen: what plays, where the playhead goes by keys, and
                         what is repeated
bench_view               The bench: the timeline of the take shown, with what plays, trims, aligns and
                         labels it
cleaning_presenter       Cleaned sound as a choice: made in a child process, heard before and after with one
                         key
cleaning_view            The button that says how the sound of a take is cleaned, with the ways to choose
                         from
findings                 What the check of a take found: as marks on the timeline, and as a list with a way
                         there and a way out
grading                  Grades of takes, found out one by one on the thread pool while nobody waits, and
                         kept
inspector_presenter      What is said of the takes that are selected, and what is changed about them
inspector_view           The inspector: everything about the takes that are selected, to be read and changed
labels_presenter         Labels by hand: typed in their place, chosen from a vocabulary, or by key while the
                         take plays
labels_view              Words to label with: a tier, its vocabulary on the keys 1 to 9, and a field for one
                         more
library_presenter        Choosing takes, and what is done to one or many at once: split, stars, words,
                         removal, the data card
library_view             The library: all takes in a table, found by search and chips, sorted by a click
missing_media_presenter  Takes whose sound, motion or folder is missing: shown as such, looked for in a
                         folder, put back
model                    What the Curate tab knows: the takes, which is shown, which are selected, and word
                         of what changed
playing                  A take read on the thread pool, and heard: the sound leads, the playhead follows at
                         the display's rate
presenter                The Curate tab: its model, its cards, and what it tells people in words
suggestions_presenter    What to fix, kept up to date with checks, choices and runs; and what its buttons do
suggestions_view         What to look at first, over the whole project: a way to each place, and a way out
                         of it
take_delegate            How a row of the library is painted: stars that can be clicked, a split chip, a
                         grade, the sound
take_table               The library as a Qt model: a row is a selection with its take and grade; a filter
                         stands in front of it
timeline_presenter       What the timeline draws of a take: its sound as waveform or spectrogram, and curves
                         of its motion
trimming_presenter       What of a take is used: its ends, spans left out, and parts where somebody speaks
trimming_view            The row under the timeline that asks whether to cut, with what to adjust before
view                     The Curate tab: library, figure, inspector, and one timeline below. Layout and
                         keys, no thought
"""
