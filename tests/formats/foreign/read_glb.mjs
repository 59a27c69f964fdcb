// Plays a GLB as three.js does, and prints where its bones are and how far its morph targets are moved.
// node read_glb.mjs FILE.glb TIMES_AS_JSON
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};
console.error = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const validator = (await import("gltf-validator")).default;

const [file, timesText] = process.argv.slice(2);
const times = JSON.parse(timesText);
const bytes = readFileSync(file);
const report = await validator.validateBytes(new Uint8Array(bytes));
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const gltf = await new GLTFLoader().parseAsync(buffer, "");
const mixer = new THREE.AnimationMixer(gltf.scene);
mixer.clipAction(gltf.animations[0]).play();

const bones = [];
const meshes = [];
gltf.scene.traverse((object) => (object.isMesh ? meshes : bones).push(object));
const frames = times.map((t) => {
  mixer.setTime(t);
  gltf.scene.updateMatrixWorld(true);
  const world = {};
  for (const bone of bones)
    world[bone.userData.name ?? bone.name] = {
      at: bone.getWorldPosition(new THREE.Vector3()).toArray(),
      turned: bone.getWorldQuaternion(new THREE.Quaternion()).toArray(),
    };
  const surfaces = meshes.map((mesh) => {
    mesh.skeleton.update();
    const count = mesh.geometry.attributes.position.count;
    const vertices = [];
    for (let i = 0; i < count; i += Math.max(1, Math.floor(count / 50)))
      vertices.push([i, ...mesh.getVertexPosition(i, new THREE.Vector3()).applyMatrix4(mesh.matrixWorld).toArray()]);
    return { name: mesh.name, weights: [...(mesh.morphTargetInfluences ?? [])], vertices };
  });
  return { world, surfaces };
});

console.log(
  JSON.stringify({
    errors: report.issues.messages.filter((m) => m.severity === 0).map((m) => `${m.code} ${m.pointer}`),
    warnings: report.issues.messages.filter((m) => m.severity === 1).map((m) => `${m.code} ${m.pointer}`),
    duration: gltf.animations[0].duration,
    targets: meshes.map((mesh) => Object.keys(mesh.morphTargetDictionary ?? {})),
    frames,
  }),
);
