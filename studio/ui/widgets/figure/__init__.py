"""A performer on the screen: the stick figure or an avatar, and a drawn face beside it.

drawn_face  A simple drawn face, since a stick figure has none: mouth, eyes and brows from the blend shapes
figure      The stick figure: a body in a room, moved at the display's rate, turned with the mouse
pane        A performer: a figure with a small face in its corner, or a large face where there are no bones
sketch      The figure drawn with plain lines: until OpenGL is warm, and where there is none
"""
