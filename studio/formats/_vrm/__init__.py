"""Reading avatars and VRM Animations: what their glTF says, taken apart.

animation  Reading a VRM Animation: whatever its rest pose, the change from a T-pose comes out
avatar     Reading an avatar: a .vrm of version 0 or 1 as bones, surfaces, expressions and terms of use
drivers    What a person has said of the blend shapes that move an avatar's faces, in a file beside it
expression Reading an avatar's named faces, what they make of its materials, and how it looks somewhere
material   Reading how an avatar's surfaces look: plain glTF, unlit, and MToon of VRM 0 and 1
mesh       The meshes of an avatar's file: one surface for each part of each mesh that a node shows
rig        What moves beside the bones: node constraints, and springs of VRM 0 and 1
"""
