// Plays a motion on an avatar as three-vrm does, sixty frames a second, and prints where some nodes are as JSON.
// node move_avatar.mjs JOBS.json, which holds [{file, frames, seen, nodes, settle}]
// A frame: {bones: {vrm1 name: [x, y, z, w]}, hips: [x, y, z], gaze: [yaw, pitch]}, in VRM 1.0's axes and degrees;
// `seen` are frames to tell of, `settle` how many seconds the first frame is held before.
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};
console.error = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");

const STEP = 1 / 60;

async function played({ file, frames, seen, nodes, settle }) {
  const bytes = readFileSync(file);
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const { vrm } = (await loader.parseAsync(buffer, "")).userData;
  const old = vrm.meta.metaVersion === "0";
  const turned = ([x, y, z, w]) => (old ? [-x, y, -z, w] : [x, y, z, w]);
  const moved = ([x, y, z]) => (old ? [-x, y, -z] : [x, y, z]);
  const rest = vrm.humanoid.normalizedRestPose.hips.position;
  const found = nodes.map((name) => vrm.scene.getObjectByName(name));
  vrm.scene.updateMatrixWorld(true);
  const still = found.map((node) => node.getWorldQuaternion(new THREE.Quaternion()).invert());

  // three-vrm 3.5.5 measures a joint against where its child was a frame ago, so that joints in motion are longer
  // or shorter than they are; here each is as long as its file has it.
  for (const joint of vrm.springBoneManager?.joints ?? []) {
    const measure = joint._calcWorldSpaceBoneLength;
    joint._calcWorldSpaceBoneLength = function () {
      const child = this.child;
      this.child = null;
      measure.call(this);
      this.child = child;
    };
  }

  const pose = (frame) => {
    const at = moved(frame.hips).map((value, i) => value - rest[i]);
    const normalised = { hips: { position: at } };
    for (const [name, q] of Object.entries(frame.bones)) (normalised[name] ??= {}).rotation = turned(q);
    vrm.humanoid.resetNormalizedPose();
    vrm.humanoid.setNormalizedPose(normalised);
    if (frame.gaze) [vrm.lookAt.yaw, vrm.lookAt.pitch] = frame.gaze;
    vrm.update(STEP);
    vrm.scene.updateMatrixWorld(true);
  };
  for (let i = 0; i < settle * 60; i++) pose(frames[0]);
  const told = {};
  frames.forEach((frame, i) => {
    pose(frame);
    if (!seen.includes(i)) return;
    told[i] = found.map((node, n) => ({
      at: moved(node.getWorldPosition(new THREE.Vector3()).toArray()),
      turned: turned(node.getWorldQuaternion(new THREE.Quaternion()).multiply(still[n]).toArray()),
    }));
  });
  return told;
}

const told = [];
for (const job of JSON.parse(readFileSync(process.argv[2], "utf8"))) told.push(await played(job));
console.log(JSON.stringify(told));
