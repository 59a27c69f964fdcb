"""Every figure about motion, numpy only: training, Review and the command line read the same numbers.

body        Where head and hands are, whether gestures fall on the beats of speech, and how varied motion is
comparison  Predicted against captured motion on the same frames: every figure, and what Review shows of a
            take (its error is the face's alone)
face        What a viewer sees in a face first: lips that close, a mouth in time with the voice, eyes that
            blink
scores      How near and how alive predicted motion is, each figure with its formula and source
"""
