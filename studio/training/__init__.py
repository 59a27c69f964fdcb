"""From takes to weights: recipes and events (no torch); loop/, losses and checkpoints (torch).

checkpoint     Weights on disk: safetensors with everything needed to use them in their header, never a
               pickle
devices        What this machine can compute on, found without loading torch
events         Events of a training run: plain values, one JSON line each (no torch)
gains          Gains that match the liveliness of each region to the capture on validation takes (no torch)
gather         Gathers training examples from a project's selections: frame rate, layout, splits and notes
loop/          The training loop on Lightning Fabric (torch): one process or many, stopped, cancelled,
               resumed
losses         Loss functions on scaled columns, by groups of channels
preview        A few seconds of a validation take as the model predicts them, kept while it trains (no
               torch)
recipe         Recipes: how a network is built and trained, as values anyone can read and change (no torch)
recipe_values  One value of a recipe: how it is written, what it may be, and what to say where it may not be
run_choice     Which run is to make a motion, and in what manner: run, style, seed and liveliness (no torch)
run_file       A run as one file: weights, recipe, channels and scaling, to be used on another computer
sampling       Where crops are cut: chance that follows from the seed and the epoch alone (no torch)
styles         Styles: which takes share one, and which is used unless a person chooses (no torch)
"""
