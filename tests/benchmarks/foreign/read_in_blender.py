"""Reads a GLB or a BVH as Blender does and prints where its bones are as JSON. Runs in a Python with bpy.

python read_in_blender.py FILE FRAMES_AS_JSON
"""

import json
import sys

import bpy


def main(file: str, frames: list[int]) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 60
    if file.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=file)
    else:
        bpy.ops.import_anim.bvh(filepath=file, axis_forward="-Z", axis_up="Y", global_scale=0.01)
    armature = next(found for found in bpy.data.objects if found.type == "ARMATURE")
    faces = [found.data for found in bpy.data.objects if found.type == "MESH" and found.data.shape_keys]
    seen = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        world = {b.name: list((armature.matrix_world @ b.matrix).translation) for b in armature.pose.bones}
        keys = {key.name: key.value for face in faces for key in face.shape_keys.key_blocks[1:]}
        seen.append({"bones": world, "shapes": keys})
    print("SEEN " + json.dumps({"version": bpy.app.version_string, "frames": seen}))


main(sys.argv[-2], json.loads(sys.argv[-1]))
