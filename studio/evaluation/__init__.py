"""A run measured on takes: figures, and the simple guesses it has to beat.

baselines       Baselines that a trained model must beat: no motion, the mean pose, ridge regression on
                stacked MFCC
evaluation_set  What a run is measured on, the takes of a split or those that somebody named, and how it is
                measured
model_card      The model card of a run: what it learnt from, how near and alive it is, what may be done with
                it
"""
