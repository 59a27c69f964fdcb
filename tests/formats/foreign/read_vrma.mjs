// Reads a VRM Animation as programs that are not ours do, and prints what they see as JSON.
// node read_vrma.mjs FILE.vrma TIMES_AS_JSON [AVATAR.vrm]
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");
const { VRMAnimationLoaderPlugin, createVRMAnimationClip } = await import("@pixiv/three-vrm-animation");
const validator = (await import("gltf-validator")).default;

const [file, timesText, avatarFile] = process.argv.slice(2);
const times = JSON.parse(timesText);

async function load(path, plugin) {
  const bytes = readFileSync(path);
  const loader = new GLTFLoader();
  loader.register(plugin);
  return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), "");
}

const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
const gltf = await load(file, (parser) => new VRMAnimationLoaderPlugin(parser));
const animation = gltf.userData.vrmAnimations[0];

// The plain glTF animation, played by three.js on the nodes of the file.
const mixer = new THREE.AnimationMixer(gltf.scene);
mixer.clipAction(gltf.animations[0]).play();
const nodes = gltf.parser.json.extensions.VRMC_vrm_animation.humanoid.humanBones;
const world = {};
const objects = await Promise.all(
  Object.entries(nodes).map(async ([name, { node }]) => [name, await gltf.parser.getDependency("node", node)]),
);
for (const [name] of objects) world[name] = { positions: [], rotations: [] };
for (const t of times) {
  mixer.setTime(t);
  gltf.scene.updateMatrixWorld(true);
  for (const [name, object] of objects) {
    world[name].positions.push(object.getWorldPosition(new THREE.Vector3()).toArray());
    world[name].rotations.push(object.getWorldQuaternion(new THREE.Quaternion()).toArray());
  }
}

const sample = (track) => {
  const interpolant = track.createInterpolant();
  return times.map((t) => Array.from(interpolant.evaluate(t)));
};
const expressions = {};
for (const group of ["preset", "custom"])
  for (const [name, track] of animation.expressionTracks[group]) expressions[name] = sample(track).map((v) => v[0]);

// The same clip on an avatar: local rotations of its normalised bones.
let avatar = null;
if (avatarFile) {
  const { vrm } = (await load(avatarFile, (parser) => new VRMLoaderPlugin(parser))).userData;
  const clip = createVRMAnimationClip(animation, vrm);
  const player = new THREE.AnimationMixer(vrm.scene);
  player.clipAction(clip).play();
  avatar = { version: vrm.meta.metaVersion, rotations: {} };
  for (const t of times) {
    player.setTime(t);
    for (const name of Object.keys(nodes)) {
      const bone = vrm.humanoid.getNormalizedBoneNode(name);
      if (bone) (avatar.rotations[name] ??= []).push(bone.quaternion.toArray());
    }
  }
}

console.log(
  JSON.stringify({
    errors: report.issues.messages.filter((m) => m.severity === 0).map((m) => m.message),
    warnings: report.issues.messages.filter((m) => m.severity === 1).map((m) => m.message),
    duration: animation.duration,
    restHips: animation.restHipsPosition.toArray(),
    world,
    expressions,
    gaze: animation.lookAtTrack ? sample(animation.lookAtTrack) : null,
    avatar,
  }),
);
