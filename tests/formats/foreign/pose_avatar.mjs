// Poses an avatar as programs that are not ours do, and prints where its bones and vertices are as JSON.
// node pose_avatar.mjs JOBS.json, which holds [{file, poses}]
// A pose: {bones: {vrm1 name: [x, y, z, w]}, hips: [x, y, z], expressions: {name: weight}}, in VRM 1.0's axes.
globalThis.self = globalThis;
globalThis.window = globalThis;
console.warn = () => {};
console.error = () => {};

const { readFileSync } = await import("node:fs");
const THREE = await import("three");
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const { VRMLoaderPlugin } = await import("@pixiv/three-vrm");
const validator = (await import("gltf-validator")).default;

async function posed({ file, poses }) {
  const bytes = readFileSync(file);
  const report = await validator.validateBytes(new Uint8Array(bytes));
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const { vrm } = (await loader.parseAsync(buffer, "")).userData;
  const old = vrm.meta.metaVersion === "0";

  // A VRM 0 faces -Z: its normalised bones take poses turned around, as three-vrm's own clips are.
  const turned = ([x, y, z, w]) => (old ? [-x, y, -z, w] : [x, y, z, w]);
  const moved = ([x, y, z]) => (old ? [-x, y, -z] : [x, y, z]);

  const rest = vrm.humanoid.normalizedRestPose.hips.position;
  const meshes = [];
  vrm.scene.traverse((object) => object.isMesh && meshes.push(object));

  vrm.scene.updateMatrixWorld(true);
  const atRest = {};
  for (const name of Object.keys(vrm.humanoid.humanBones))
    atRest[name] = vrm.humanoid.getRawBoneNode(name)?.getWorldQuaternion(new THREE.Quaternion());

  const seen = poses.map((pose) => {
    // A pose's position counts from rest.
    const at = moved(pose.hips).map((value, i) => value - rest[i]);
    const normalised = { hips: { position: at } };
    for (const [name, q] of Object.entries(pose.bones)) (normalised[name] ??= {}).rotation = turned(q);
    vrm.humanoid.resetNormalizedPose();
    vrm.humanoid.setNormalizedPose(normalised);
    vrm.expressionManager?.resetValues?.();
    for (const [name, weight] of Object.entries(pose.expressions)) vrm.expressionManager?.setValue(name, weight);
    vrm.humanoid.update();
    vrm.expressionManager?.update();
    vrm.scene.updateMatrixWorld(true);
    const bones = {};
    for (const name of Object.keys(vrm.humanoid.humanBones)) {
      const node = vrm.humanoid.getRawBoneNode(name);
      if (!node) continue;
      // The change from rest: what the bone is turned in the world, less what it is turned at rest.
      const now = node.getWorldQuaternion(new THREE.Quaternion());
      const change = turned(now.multiply(atRest[name].clone().invert()).toArray());
      bones[name] = { at: moved(node.getWorldPosition(new THREE.Vector3()).toArray()), turned: change };
    }
    const vertices = meshes.map((mesh) => {
      if (mesh.isSkinnedMesh) mesh.skeleton.update();
      const found = [];
      const count = mesh.geometry.attributes.position.count;
      for (let i = 0; i < count; i += Math.max(1, Math.floor(count / 60))) {
        const v = mesh.getVertexPosition(i, new THREE.Vector3()).applyMatrix4(mesh.matrixWorld);
        const still = new THREE.Vector3().fromBufferAttribute(mesh.geometry.attributes.position, i);
        found.push({ rest: still.toArray(), at: moved(v.toArray()) });
      }
      return found;
    });
    return { bones, vertices };
  });

  return {
    version: vrm.meta.metaVersion,
    expressions: vrm.expressionManager?.expressions.map((e) => e.expressionName) ?? [],
    errors: report.issues.messages.filter((m) => m.severity === 0).map((m) => `${m.code} ${m.pointer}`),
    seen,
  };
}

const seen = [];
for (const job of JSON.parse(readFileSync(process.argv[2], "utf8"))) seen.push(await posed(job));
console.log(JSON.stringify(seen));
