"""A performer as a picture: a stick figure or an avatar in a room, off screen. Pixels, no Qt.

actors      The stick figure and the avatar in VTK: meshes that are moved in place
background  What is behind a performer: the room, one colour, an image, or nothing
body        The figure's shape: a capsule for every bone, a ball for every joint, a head with eyes
camera      Where the figure is seen from: an orbit around the body, and what of it fits the picture
drawing     Options and painter of films and stills of a motion. No window is needed
face        What a face looks like, read from blend shapes of any set, as a drawing, and fitted to an avatar
mannequin   A plain body for any skeleton, with a face that every blend shape moves: for files that need a
            mesh
palette     The colours of a picture, and "#RRGGBB" in numbers
scene       The scene in VTK: an off-screen pyvista plotter that renders a world pose to pixels
toon        The shader of an avatar's surfaces: plain, unlit and MToon, in VTK's own OpenGL mapper
world_pose  World-space joints, rotations and blend shapes of one pose, ready to draw
"""
