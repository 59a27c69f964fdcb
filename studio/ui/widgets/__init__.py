"""Pieces that several tabs draw with.

avatar_button  The button in a picture's corner that chooses an avatar, and what its file allows
background_menu  The menu of backgrounds: the room, transparent, green, any colour, or an image
card           Cards, headings and empty states: the furniture every tab shares
face_dialog    An avatar's faces: each shape, what moves it, a try, and a person's correction
figure/        A performer on the screen: the stick figure or an avatar, and a drawn face beside it
meters         Meters: the level of the sound, and the values of blend shapes as bars
plots          Plots that several places draw: values by epoch, and how well sound and motion match by offset
run_chooser    Which run makes the motion: the run, its style, how lively, and another throw of the dice
send_panel     Where motion is sent: a list of avatar programs, a row each, and how frames are written for
               them
timeline/      The timeline: sound, motion, labels and problems under one playhead
"""
