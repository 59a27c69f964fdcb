// Turns an avatar's head at once and lets its hair swing in three-vrm; prints where the joints' ends are, as JSON.
// node swing_avatar.mjs FILE DEGREES SECONDS...
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};
console.error = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");

const [file, degrees, ...moments] = process.argv.slice(2);
const bytes = readFileSync(file);
const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const { vrm } = (await loader.parseAsync(buffer, "")).userData;

const STEP = 1 / 60;
const step = (count) => {
  for (let i = 0; i < count; i++) vrm.update(STEP);
};
step(600);
vrm.humanoid.getNormalizedBoneNode("head").rotation.y = (Number(degrees) * Math.PI) / 180;
const seen = {};
let done = 0;
for (const moment of moments) {
  const steps = Math.round(Number(moment) / STEP);
  step(steps - done);
  done = steps;
  vrm.scene.updateMatrixWorld(true);
  seen[moment] = {};
  for (const joint of vrm.springBoneManager.joints)
    if (joint.child) seen[moment][joint.child.name] = joint.child.getWorldPosition(new THREE.Vector3()).toArray();
}
console.log(JSON.stringify(seen));
