"""Takes chosen and marked for training: choices apart from recordings.

balance      Split automatically: dividing selections among train, val and test, only when asked; a new take
             is train (Selection.split). Each gets its share of the seconds and of every label
coverage     Which kinds of speech takes hold, and which are missing: while recording, and of what is learnt
             from
data_card    What a dataset holds, counted, and the page that shows it: one HTML file
dataset      The choices made about takes: in and out points, offsets, labels, split. All values are frozen
edits        What a person can do to the choices: pure functions Dataset -> Dataset
history      Undo and redo by keeping the old value, and dataset.json with the steps that undo can take
label_files  Labels to and from other programs' files (Audacity, Praat, ELAN), and vocabularies to label
             with
material     What a selection gives to learn from: its sound and its motion, both from the in point on
pauses       One take cut into many where nobody speaks: which spans stay, and the edit that makes parts of
             them
prompts      What a teleprompter asks for: prompts by language, which comes next, and where each was said
relink       Files of takes that are missing: found again in another folder, by name and by what is in them
suggest      Suggestions of likely bad takes and spans, worst first, to be looked at and excluded
"""

from studio.dataset.dataset import Dataset, Label, Selection

__all__ = ["Dataset", "Label", "Selection"]
