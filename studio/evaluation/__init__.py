"""A run measured on takes: figures, and the simple guesses it has to beat.

evaluation_set  What a run is measured on, the takes of a split or those named, how, and the baselines it
                must beat
learning_curve  How much better a run would be of more takes: trained on a quarter, a half and all of them
look_aheads     How good a run is at each look-ahead it offers to live use, measured and kept in its report
model_card      The model card of a run: what it learnt from, how near and alive it is, what may be done
                with it
verdict         A run in words: how good it is, what would help most, and what that was measured on. No torch
"""
