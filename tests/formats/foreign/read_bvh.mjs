// Reads a BVH as three.js does, and prints where every joint is as JSON.
// node read_bvh.mjs FILE.bvh TIMES_AS_JSON
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { BVHLoader } = await import("three/addons/loaders/BVHLoader.js");

const [file, timesText] = process.argv.slice(2);
const { skeleton, clip } = new BVHLoader().parse(readFileSync(file, "utf8"));
const root = skeleton.bones[0];
const mixer = new THREE.AnimationMixer(root);
mixer.clipAction(clip).play();
const frames = JSON.parse(timesText).map((t) => {
  mixer.setTime(t);
  root.updateMatrixWorld(true);
  return Object.fromEntries(
    skeleton.bones
      .filter((bone) => bone.name !== "ENDSITE")
      .map((bone) => [
        bone.name,
        {
          at: bone.getWorldPosition(new THREE.Vector3()).toArray(),
          turned: bone.getWorldQuaternion(new THREE.Quaternion()).toArray(),
        },
      ]),
  );
});
console.log(JSON.stringify({ duration: clip.duration, frames }));
