"""The Curate tab: the library, the timeline, trims, offsets and labels.

alignment_presenter      Presenter of the offset between sound and motion: measured, or nudged by hand
alignment_view           What aligning found: one take with its curve in full, or many in a table
bench_presenter          Presenter of the take shown: what plays, where the playhead goes, what is repeated
bench_view               The bench: the timeline of the take shown, and the buttons that change it
checks                   Checks of takes: made while nobody waits, and what they found as marks
labels_presenter         Presenter of labels: typed, chosen from a vocabulary, or by key while the take plays
labels_view              Words to label with: a tier, its vocabulary on the keys 1 to 9, a field for one more
library_presenter        Presenters of library and inspector, and of the data card
library_view             The library: all takes in a table, found by search and chips
inspector_view           The inspector: everything about the selected takes, to be read and changed
missing_media_presenter  Presenter of takes whose sound, motion or folder is missing
model                    What the tab knows: the takes, which is shown, which are selected; word of changes
playback                 A take read on the thread pool, and heard; the playhead follows the sound
presenter                Presenter of the tab: builds its model and its cards
split_bar                How much of the takes is for training, validation and testing, as one bar
suggestions_presenter    Presenter of what to fix over the whole project
suggestions_view         Lists of what is wrong: in one take, and over the whole project
take_delegate            How a row of the library is painted: stars, a split chip, a grade, the sound
take_table               The library as a Qt model: a row is a selection with its take and grade; a filter
timeline_presenter       Presenter of the timeline's lanes: waveform or spectrogram, and curves of the motion
tools_presenter          Presenters of the bench's tools: trims and spans left out, cuts, cleaned sound
tools_view               Tools of the bench that ask first: the ways of cleaning, and the cut row
view                     Layout of the tab and its keys
"""
