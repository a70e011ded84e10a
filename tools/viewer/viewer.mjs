// A face that plays one clip of a GLB on a canvas. Bundled as a classic script, which leaves `nmsViewer` behind: module
// scripts and fetch do not load from file://.
import {
  AnimationMixer, Box3, Color, DirectionalLight, HemisphereLight, LoopRepeat, PerspectiveCamera, Scene, Vector3,
  WebGLRenderer,
} from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';

/** Turns of the camera about the face, in degrees; positive: the face's own left comes to the front. */
const VIEWS = { front: 0, threequarter: 35, side: 80 };
const HEIGHT = 0.31; // m, of the picture, where the face is: it has room to lean and turn
const LENS = 14; // degrees, of the picture's height: a long lens, so that a head that comes forward hardly grows
const FOCUS = 0.13; // m, below the crown: the middle of the face

/**
 * @param canvas  on which it is drawn, at the size that the page gives it
 * @param bytes   ArrayBuffer of the GLB
 * @param clip    name of the animation
 * @returns a player, paused at the clip's start. Throws if there is no WebGL or no such clip.
 */
export async function show(canvas, bytes, clip) {
  const renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  const gltf = await new GLTFLoader().parseAsync(bytes, '');
  const animation = gltf.animations.find((a) => a.name === clip);
  if (!animation) throw new Error(`no clip ${clip}`);

  const scene = new Scene();
  scene.add(new HemisphereLight(0xffffff, 0x8a8078, 1.6));
  for (const [x, y, z, power] of [[0.5, 0.6, 1, 1.8], [-0.9, 0.2, 0.5, 0.7]]) {
    const light = new DirectionalLight(0xffffff, power);
    light.position.set(x, y, z);
    scene.add(light);
  }
  scene.add(gltf.scene);
  const box = new Box3().setFromObject(gltf.scene); // at rest
  const size = box.getSize(new Vector3());
  const focus = new Vector3(0, box.max.y - Math.min(FOCUS, 0.42 * size.y), box.max.z - 0.07);
  const camera = new PerspectiveCamera(LENS, 1, 0.01, 10);
  const distance = HEIGHT / 2 / Math.tan(LENS / 2 * Math.PI / 180);

  const mixer = new AnimationMixer(gltf.scene);
  const action = mixer.clipAction(animation);
  action.setLoop(LoopRepeat, Infinity).play();

  let angle = 0;
  let frame = 0;
  let before = 0;
  const player = {
    duration: animation.duration,
    speed: 1,
    time: 0,
    playing: false,
    ontime: null, // called with the player after each picture
    play() {
      if (player.playing) return;
      player.playing = true;
      before = 0;
      frame = requestAnimationFrame(step);
    },
    pause() {
      player.playing = false;
      cancelAnimationFrame(frame);
    },
    seek(time) {
      player.time = Math.min(Math.max(time, 0), player.duration);
      draw();
    },
    view(name) {
      angle = (VIEWS[name] ?? 0) * Math.PI / 180;
      draw();
    },
    background(color) {
      scene.background = new Color(color);
      draw();
    },
    resize,
  };

  function draw() {
    camera.position.set(focus.x + Math.sin(angle) * distance, focus.y, focus.z + Math.cos(angle) * distance);
    camera.lookAt(focus);
    // Not `duration` itself, which a loop takes for its start.
    mixer.setTime(Math.min(player.time, player.duration * (1 - 1e-6)));
    renderer.render(scene, camera);
    player.ontime?.(player);
  }
  function step(now) {
    if (!player.playing) return;
    if (before !== 0 && player.duration > 0) {
      player.time = (player.time + (now - before) / 1000 * player.speed) % player.duration;
    }
    before = now;
    draw();
    frame = requestAnimationFrame(step);
  }
  function resize() {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0 || height === 0) return;
    renderer.setPixelRatio(Math.min(globalThis.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  }
  new ResizeObserver(resize).observe(canvas);
  resize();
  return player;
}
