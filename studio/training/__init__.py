"""From takes to weights: recipes and events (no torch); loop/, losses and checkpoints (torch).

checkpoint     Weights on disk: safetensors with everything needed to use them in their header, never a
               pickle
devices        What this machine can compute on, found without loading torch
duration       How long a training takes on this computer: as earlier ones did, else by a short probe
               (no torch)
fit_style      A style that a finished run is shown by some seconds of a take; its network stays as it
               is (torch)
gather         Gathers training examples from a project's selections: frame rate, layout, splits and notes,
               and what is held back where nothing is marked for validation
loop/          The training loop on Lightning Fabric (torch): one process or many, stopped, killed,
               resumed
losses         Loss functions on scaled columns, by groups of channels
preview        A few seconds of a validation take as the model predicts them, kept while it trains (no
               torch)
recipe         Recipes: how a network is built and trained, as values anyone can read and change (no torch)
recipe_values  One value of a recipe: how it is written, what it may be, and what to say where it may not be
run_file       A run as one file: weights, recipe, channels and scaling, to be used on another computer
styles         Styles, of which the average is the default, and which run, style, seed and liveliness are to
               make a motion (no torch)
"""
