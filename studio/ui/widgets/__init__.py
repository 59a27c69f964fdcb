"""Pieces that several tabs draw with.

avatar_button     The button in a picture's corner that chooses an avatar, and what its file allows
card              Cards, headings and empty states: the furniture every tab shares
correlation_plot  How well motion and sound fit at every offset: a small curve with its best place marked
figure/           A performer on the screen: the stick figure or an avatar, and a drawn face beside it
level_meter       The level of a microphone: loudness, peak, hold, and a lamp that stays on after clipping
loss_plot         Curves of a training run: one plot, several series over epochs, the best epoch marked
run_chooser       Which run makes the motion: the run, its style, how lively, and another throw of the dice
send_panel        Where motion is sent: a list of avatar programs, and how frames are written for them
shape_meters      Every incoming blend shape as a live meter, painted in one widget: thousands of updates a
                  second
target_row        One program that motion is sent to: where it listens, its state light, and a test wave
timeline/         The timeline: sound, motion, labels and problems under one playhead
"""
