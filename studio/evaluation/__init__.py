"""A run measured on takes: figures, and the simple guesses it has to beat.

baselines       Baselines that a trained model must beat: no motion, the mean pose, ridge regression on
                stacked MFCC
evaluation_set  What a run is measured on, the takes of a split or those that somebody named, and how it is
                measured
look_aheads     How good a run is at each look-ahead it offers to live use, measured and kept in its report
"""
