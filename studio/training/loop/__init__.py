"""The training loop on Lightning Fabric (torch): one process or many, stopped, killed, resumed.

run_folder  A run's folder as the loop writes it: recipe, metrics, report, TensorBoard, progress; rank 0
            alone
setup       Sets up a training: Fabric, fresh model, loss, optimiser, learning rate, out-of-memory handling
step        Optimiser steps on batches of crops, drawn from seed and epoch alone; processes share a batch
train       The training loop, on Lightning Fabric: one process or many, stopped, killed, resumed
validation  Validation while training: whole takes predicted, loss, figures, best style, and gains of each
            region
"""
