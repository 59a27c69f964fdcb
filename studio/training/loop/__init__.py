"""The training loop on Lightning Fabric (torch): one process or many, stopped, cancelled, resumed.

run_folder  A run's folder as the loop writes it: recipe, metrics, report, TensorBoard; rank 0 alone
setup       Sets up a training: Fabric, fresh model, loss, optimiser, learning rate, out-of-memory handling
state       Progress of a training, saved by rank 0 after every epoch and restored on resume
step        Optimiser steps on batches of crops; several processes share each batch
train       The training loop, on Lightning Fabric: one process or many, stopped, cancelled, resumed
validation  Validation while training: whole takes predicted, loss, figures, best style and gains
"""
