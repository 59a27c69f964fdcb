"""A performer on the screen: the stick figure or an avatar, and a drawn face beside it.

figure  The stick figure: a body in a room, moved at the display's rate, turned with the mouse
pane    A performer: a figure with a small face in its corner, or a large face where there are no bones
picture A performer's picture in two images, what stays behind and their own part; and how finely it is drawn
sketch  What is drawn with plain lines: the figure until OpenGL is warm, and a simple face
view_buttons  The buttons over a picture: how near the performer is, and from which side
"""
