// What three.js shows of a file at some times: names of the targets, weights and vertices of every mesh, as JSON.
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [modules, file, ...times] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(modules, 'three', name)));
const THREE = await load('build/three.module.js');
globalThis.ProgressEvent ??= class {};
// the loader imports 'three' by name, which is found beside it
const { GLTFLoader } = await load('examples/jsm/loaders/GLTFLoader.js');

const bytes = fs.readFileSync(file);
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const gltf = await new GLTFLoader().parseAsync(data, '');
const mixer = new THREE.AnimationMixer(gltf.scene);
gltf.animations.forEach((clip) => mixer.clipAction(clip).setLoop(THREE.LoopOnce).play());
const meshes = [];
gltf.scene.traverse((object) => object.isMesh && meshes.push(object));
const shown = times.map((time) => {
  mixer.setTime(Number(time));
  return meshes.map((mesh) => {
    const point = new THREE.Vector3();
    const points = [];
    for (let i = 0; i < mesh.geometry.attributes.position.count; i++) points.push(...mesh.getVertexPosition(i, point).toArray());
    return { name: mesh.name, targets: Object.keys(mesh.morphTargetDictionary ?? {}), weights: [...(mesh.morphTargetInfluences ?? [])], points };
  });
});
console.log(JSON.stringify({ shown, duration: gltf.animations.map((clip) => clip.duration) }));
