"""A performer as a picture: a stick figure or an avatar in a room, off screen. Pixels, no Qt.

avatar_actor  Actor of an avatar in VTK: its surfaces, skinned on the processor and moved in place
body          The figure's shape: a capsule for every bone, a ball for every joint, a head with eyes
camera        Where the figure is seen from: an orbit around the body, and what of it fits the picture
drawing       Options and painter of films and stills of a motion. No window is needed
face          What a face looks like, read from blend shapes of any set, and fitted to an avatar without
              names. Pure
face_card     A simple drawn face for films, since a stick figure has none: mouth, eyes and brows from the
              shapes. No Qt
mannequin     A plain body for any skeleton, with a face that every blend shape moves: for files that need a
              mesh
palette       The colours of a picture
room          The room a figure stands in: a floor grid that fades, and a soft shadow
scene         The scene in VTK: an off-screen pyvista plotter that renders a world pose to pixels
stick         The stick figure in VTK: its meshes, moved in place
world_pose    World-space joints, rotations and blend shapes of one pose, ready to draw
"""
