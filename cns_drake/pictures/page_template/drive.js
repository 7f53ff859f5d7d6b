// Connects the panels with the scene. `viewer` is Meshcat's viewer; `commands`
// is a promise of the scene's commands.

// Folded from the start, so that the sheet does not hide the city on a phone.
document.body.classList.toggle("folded", innerWidth <= 640);

const byId = (id) => document.getElementById(id);
const node = (...path) => viewer.scene_tree.find(path);
const car = node("vehicle", "base_link").object;
const animator = viewer.animator;
const marker = node("vehicle", "marker").object;
const UP = new MeshCat.THREE.Vector3(0, 1, 0);
const MARKER_AXIS = new MeshCat.THREE.Vector3(0, 0, 1);

// Latest pose of the car that the camera follows; null if the camera stands
// still.
let followed = null;
// Plots of the drive: the element that shows the present value, and all values.
const plots = [...document.querySelectorAll(".plot output")].map((output) => (
  {output, values: output.dataset.values.split(",")}));
// Images of each camera of the car, in the order of time.
const cameras = [...document.querySelectorAll("#cameras figure")].map(
  (figure) => [...figure.querySelectorAll("img")]);
// Position and target of the camera before it followed the car.
let overview = null;

function show(...path) {
  return (on) => viewer.set_property(path, "visible", on);
}

// In the world of three.js, y is up.
function carPose() {
  car.updateWorldMatrix(true, false);
  const m = car.matrixWorld.elements;
  return {
    position: new MeshCat.THREE.Vector3(m[12], m[13], m[14]),
    heading: Math.atan2(-m[2], m[0]),
  };
}

function look(position, target) {
  viewer.camera.position.copy(position);
  viewer.controls.target.copy(target);
  viewer.camera.lookAt(target);
  viewer.set_dirty();
}

// The marker stands above the car on the screen, whichever way the camera
// looks, and so never hides the car. The marker has the same size on the screen
// at all distances.
function placeMarker() {
  const {position} = carPose();
  const away = viewer.camera.position.distanceTo(position);
  const up = UP.clone().applyQuaternion(viewer.camera.quaternion);
  position.addScaledVector(up, Math.max(2.5, 0.02 * away));
  const inScene = marker.parent.getWorldQuaternion(
    new MeshCat.THREE.Quaternion()).invert();
  marker.position.copy(marker.parent.worldToLocal(position));
  marker.quaternion.setFromUnitVectors(
    MARKER_AXIS, up.applyQuaternion(inScene));
  marker.scale.setScalar(away / 150);
}

// Camera and target move and turn with the car, so that the user can look at
// the car from all sides.
function follow() {
  const now = carPose();
  const moved = (point) => point.clone().sub(followed.position)
    .applyAxisAngle(UP, now.heading - followed.heading).add(now.position);
  look(moved(viewer.camera.position), moved(viewer.controls.target));
  followed = now;
}

function setFollowing(on) {
  // Near the car, the marker and the route hide other things.
  show("vehicle", "marker")(!on);
  viewer.set_property(["route"], "opacity", on ? 0.35 : 1);
  if (on) {
    overview = [viewer.camera.position.clone(), viewer.controls.target.clone()];
    followed = carPose();
    // On a narrow screen, the camera must be farther away to show the street.
    const far = viewer.camera.aspect < 1 ? 1.5 : 1;
    const fromCar = (x, y) => new MeshCat.THREE.Vector3(x, y, 0)
      .applyAxisAngle(UP, followed.heading).add(followed.position);
    look(fromCar(-25 * far, 14 * far), fromCar(5, 0));
  } else {
    followed = null;
    look(...overview);
  }
}

// Whatever is between the camera and the car has a hole, through which the car
// is seen; only the ground has none.
const hole = {car: {value: new MeshCat.THREE.Vector3()}, radius: {value: 0}};
const GROUND = ["road", "parking", "sidewalk", "other-ground", "terrain"];

function makeHole(material) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.holeCar = hole.car;
    shader.uniforms.holeRadius = hole.radius;
    shader.fragmentShader = shader.fragmentShader
      .replace("void main() {", `
        uniform vec3 holeCar;
        uniform float holeRadius;
        void main() {
          if (vViewPosition.z < -holeCar.z - 3.0) {
            float grain = fract(52.98 * fract(
              dot(gl_FragCoord.xy, vec2(0.0671, 0.0058))));
            vec2 off = -vViewPosition.xy / vViewPosition.z +
              holeCar.xy / holeCar.z;
            if (length(off) < holeRadius * (0.8 + 0.2 * grain)) discard;
          }`);
  };
  material.needsUpdate = true;
}

function placeHole() {
  const {camera} = viewer;
  camera.updateMatrixWorld();
  hole.car.value.copy(carPose().position)
    .applyMatrix4(camera.matrixWorldInverse);
  hole.radius.value = Math.max(7 / Math.max(-hole.car.value.z, 7), 0.035);
}

// The two sides of the divider: what only the earlier stage has, and what only
// the later one has. The drive's own side is visible from the start.
const divider = byId("divider");
const sides = ["before", "after"].map((name) => ({
  layer: node(name).object, isOwn: undefined, colour: divider?.dataset[name]}));
let divided = false;
let share = 0.5;
let isCityOn = true;

function placeDivider(x) {
  share = Math.min(Math.max(x / innerWidth, 0), 1);
  divider.style.left = `${100 * share}%`;
  divider.ariaValueNow = Math.round(100 * share);
  viewer.set_dirty();
}

function setDivided(on) {
  divided = on;
  document.body.classList.toggle("changed", on);
  divider.hidden = !on;
  for (const {layer, colour} of sides) {
    layer.traverse(({material}) => {
      if (!material) return;
      material.color.set(on ? colour : "white");
      material.emissive?.set(on ? colour : "black");
      material.emissiveIntensity = 0.12;
    });
  }
  showSides();
}

function showSides() {
  for (const {layer, isOwn} of sides) layer.visible = isCityOn && isOwn;
  viewer.set_dirty();
}

function setCity(on) {
  isCityOn = on;
  show("city")(on);
  showSides();
}

// Draws the scene, or the two sides of the divider.
function divide(renderer) {
  const draw = renderer.render.bind(renderer);
  renderer.render = (scene, camera) => {
    if (!divided || !isCityOn) return draw(scene, camera);
    const edge = Math.round(share * innerWidth);
    renderer.setScissorTest(true);
    for (const [k, x, width] of [[0, 0, edge], [1, edge, innerWidth - edge]]) {
      sides.forEach(({layer}, side) => { layer.visible = side === k; });
      renderer.setScissor(x, 0, width, innerHeight);
      draw(scene, camera);
    }
    renderer.setScissorTest(false);
    for (const {layer, isOwn} of sides) layer.visible = isOwn;
  };
}

// All points of a scan, from the page's own data. See `PackedScan` in Python.
async function unpack({dataset, textContent}) {
  const packed = await fetch(
    "data:application/octet-binary;base64," + textContent);
  const planes = new Uint8Array(await new Response(packed.body.pipeThrough(
    new DecompressionStream("deflate"))).arrayBuffer());
  const origin = dataset.origin.split(",").map(Number);
  const grid = Number(dataset.grid);
  const count = planes.length / 6;
  const points = new Float32Array(3 * count);
  for (let axis = 0; axis < 3; ++axis) {
    const low = 2 * axis * count;
    const high = low + count;
    let value = 0;
    for (let k = 0; k < count; ++k) {
      const signless = planes[low + k] | planes[high + k] << 8;
      const step = (signless >>> 1) ^ -(signless & 1);
      value = (value + step) << 16 >> 16;
      points[3 * k + axis] = origin[axis] + grid * value;
    }
  }
  return points;
}

const scans = [...document.querySelectorAll("script.scan")];
const times = scans.map(({dataset}) => Number(dataset.time));
// Index of a scan near the play head -> its geometry, null while it is decoded.
const nearScans = new Map();
const {colours: heightColours, lowest, highest} = byId("points").dataset;
const heightScale = heightColours.split(",").map(
  (one) => new MeshCat.THREE.Color(one));
const cloud = new MeshCat.THREE.Points(
  new MeshCat.THREE.BufferGeometry(),
  new MeshCat.THREE.PointsMaterial(
    {size: 2.5, sizeAttenuation: false, vertexColors: true}));
cloud.frustumCulled = false;
// Points are drawn a little nearer than the surfaces on which they lie.
cloud.material.onBeforeCompile = (shader) => {
  shader.vertexShader = shader.vertexShader.replace(
    "#include <project_vertex>",
    `#include <project_vertex>
    gl_Position = projectionMatrix * vec4(0.99 * mvPosition.xyz, 1.0);`);
};
node("scans").object.add(cloud);

async function decode(index) {
  nearScans.set(index, null);
  const points = await unpack(scans[index]);
  if (!nearScans.has(index)) return;
  const colours = new Float32Array(points.length);
  const colour = new MeshCat.THREE.Color();
  for (let k = 0; k < points.length; k += 3) {
    const level = Math.min(Math.max(
      (points[k + 2] - lowest) / (highest - lowest), 0), 1);
    const at = level * (heightScale.length - 1);
    const below = Math.min(Math.floor(at), heightScale.length - 2);
    colour.lerpColors(heightScale[below], heightScale[below + 1], at - below)
      .toArray(colours, k);
  }
  const {BufferAttribute, BufferGeometry} = MeshCat.THREE;
  nearScans.set(index, new BufferGeometry()
    .setAttribute("position", new BufferAttribute(points, 3))
    .setAttribute("color", new BufferAttribute(colours, 3)));
  viewer.set_dirty();
}

// Shows the latest scan; decodes the next ones, and forgets those far away.
function showScan() {
  if (!scans.length) return;
  const now = animator.time + 1e-3;
  const index = Math.max(times.findLastIndex((time) => time <= now), 0);
  for (const k of [index, index + 1, index + 2]) {
    if (k in scans && !nearScans.has(k)) decode(k);
  }
  for (const [k, geometry] of nearScans) {
    if (Math.abs(k - index) <= 3) continue;
    geometry?.dispose();
    nearScans.delete(k);
  }
  cloud.geometry = nearScans.get(index) ?? cloud.geometry;
}

function connectSwitch(id, set) {
  byId(id)?.addEventListener("change", ({target}) => {
    set(target.checked);
    centre();
  });
}

// Centres the picture in the part of the window above the bar or the sheet.
function centre() {
  const top = byId("bar").getBoundingClientRect().top;
  const sheet = byId("sheet").getBoundingClientRect();
  const covered = innerHeight - (sheet.height ? sheet.top : top);
  viewer.camera.setViewOffset(
    innerWidth, innerHeight, 0, covered / 2, innerWidth, innerHeight);
  if (divider) divider.style.bottom = `${covered}px`;
  viewer.set_dirty();
}

function fold(on) {
  document.body.classList.toggle("folded", on);
  byId("fold").textContent = on ? "More" : "Less";
  byId("fold").ariaExpanded = !on;
  centre();
}

function setTime(time) {
  // An action that has ended is paused, and would stay at its end.
  for (const action of animator.actions) action.paused = false;
  animator.seek(time);
  animator.display_progress(time);
}

function showTime() {
  // Rounded, as the duration in the panel is.
  const minutes = (time) => {
    const s = Math.round(time);
    return `${Math.floor(s / 60)}:${String(s % 60).padStart(2, "0")}`;
  };
  byId("time").value = animator.time;
  byId("clock").value =
    `${minutes(animator.time)} / ${minutes(animator.duration)}`;
  byId("play").textContent = animator.playing ? "Pause" : "Play";
  const share = animator.time / animator.duration || 0;
  if (byId("now")) byId("now").style.left = `${100 * share}%`;
  for (const plot of plots) {
    const value = plot.values[Math.round(share * (plot.values.length - 1))];
    plot.output.value = `${value} ${plot.output.dataset.unit}`;
  }
}

// Where the car is at each frame of the animation, [x, y, z] in the world W, and
// the frame's time.
function carTrack() {
  const clip = animator.actions.find((action) => action.getRoot() === car)
    .getClip();
  const {times: at, values} = clip.tracks.find(
    ({name}) => name.endsWith("position"));
  return [...at].map((time, k) => ({time, place: values.slice(3 * k, 3 * k + 3)}));
}

// In a page of two drives, one leads: the first, or the one that the user
// touched last. The other one goes to the same place, and its camera looks from
// the same side.
let leads = window.name === "leader";
let track = null;

function tell() {
  if (!leads) return;
  const {camera, controls} = viewer;
  const {position, heading} = carPose();
  const seen = (point) => (followed
    ? point.clone().sub(position).applyAxisAngle(UP, -heading)
    : point.clone()).toArray();
  parent.postMessage({
    place: car.position.toArray(),
    follows: Boolean(followed),
    camera: seen(camera.position),
    target: seen(controls.target),
  }, "*");
}

function listen({data}) {
  leads = false;
  if (animator.playing) animator.pause();
  track ??= carTrack();
  const far = ({place}) => Math.hypot(
    place[0] - data.place[0], place[1] - data.place[1]);
  // Where a route crosses itself, the nearer time counts.
  const cost = (one) => far(one) + 0.02 * Math.abs(one.time - animator.time);
  const {time} = track.reduce((a, b) => (cost(b) < cost(a) ? b : a));
  setTime(time);
  if (data.follows !== Boolean(followed)) byId("follow").click();
  const {position, heading} = carPose();
  const seen = (point) => {
    const there = new MeshCat.THREE.Vector3(...point);
    return data.follows
      ? there.applyAxisAngle(UP, heading).add(position) : there;
  };
  if (followed) followed = carPose();
  look(seen(data.camera), seen(data.target));
}

// Shows the latest image of each camera.
function showImages() {
  for (const images of cameras) {
    const now = images.findLast(
      ({dataset}) => Number(dataset.time) <= animator.time + 1e-3) ?? images[0];
    for (const image of images) image.hidden = image !== now;
  }
}

// Meshcat calls this function before it draws a picture.
viewer.render_callback = () => {
  if (followed) follow();
  placeMarker();
  placeHole();
  tell();
  showTime();
  showScan();
  showImages();
};

// Colours as given, instead of the tone mapping of a film.
viewer.renderer.toneMapping = MeshCat.THREE.NeutralToneMapping;

// While the scene loads, no pictures are drawn, which would slow down loading.
const drawPicture = viewer.animate;
viewer.animate = () => {};

commands.then(() => {
  viewer.animate = drawPicture;
  for (const name of ["city", "before", "after"]) {
    for (const layer of node(name).object.children) {
      if (GROUND.includes(layer.name)) continue;
      layer.traverse(({material}) => {
        if (material) makeHole(material);
      });
    }
  }
  divide(viewer.renderer);
  for (const side of sides) side.isOwn = side.layer.visible;
  byId("loading").remove();
  byId("time").max = animator.duration;
  byId("time").addEventListener("input", (event) => {
    setTime(Number(event.target.value));
  });
  byId("play").addEventListener("click", () => {
    if (animator.playing) animator.pause();
    else animator.play();
    showTime();
  });
  connectSwitch("follow", setFollowing);
  connectSwitch("change", setDivided);
  connectSwitch("points", show("scans"));
  connectSwitch("route", show("route"));
  connectSwitch("moving", show("moving"));
  connectSwitch("city", setCity);
  connectSwitch("images", (on) => {
    byId("cameras").hidden = !on;
  });
  divider?.addEventListener("pointerdown", ({pointerId}) => {
    divider.setPointerCapture(pointerId);
  });
  divider?.addEventListener("pointermove", ({pointerId, clientX}) => {
    if (divider.hasPointerCapture(pointerId)) placeDivider(clientX);
  });
  divider?.addEventListener("keydown", ({key}) => {
    const step = {ArrowLeft: -1, ArrowRight: 1}[key];
    if (step) placeDivider((share + 0.02 * step) * innerWidth);
  });
  byId("fold").addEventListener("click", () => {
    fold(!document.body.classList.contains("folded"));
  });
  addEventListener("resize", centre);
  // A control that has the focus handles the space bar itself.
  addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target !== document.body) return;
    event.preventDefault();
    byId("play").click();
  });
  fold(innerWidth <= 640 || parent !== window);
  if (parent !== window) {
    for (const kind of ["pointerdown", "keydown", "wheel"]) {
      addEventListener(kind, () => { leads = true; }, {capture: true});
    }
    addEventListener("message", listen);
  }
  // On a narrow screen, the camera must be farther away to show the city.
  const {camera, controls} = viewer;
  const farther = Math.max(1, 1.2 / camera.aspect);
  look(camera.position.clone().sub(controls.target).multiplyScalar(farther)
    .add(controls.target), controls.target.clone());
  setFollowing(true);
});
