// Connects the panels with the scene. `viewer` is Meshcat's viewer; `commands`
// is a promise of the scene's commands.

// Folded from the start, so that the panels do not hide the city.
document.body.classList.add("folded");

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

// What the camera cannot look through: the heights [m] of the highest surfaces
// over cells of 1 m, around the drive.
const SEE_THROUGH = [
  "vegetation", "trunk", "pole", "traffic-sign", "other-object"];
const AROUND = 60;
let roofs = null;

function readRoofs() {
  const [low, high] = [Math.min, Math.max].map((end, k) => [0, 1].map(
    (axis) => Math.round(end(...track.map(({place}) => place[axis])))
      + AROUND * (2 * k - 1)));
  const columns = high[0] - low[0];
  const tops = new Float32Array(columns * (high[1] - low[1])).fill(-Infinity);
  const points = new Float32Array(9);
  const layers = [node("city").object, ...sides.filter(({isOwn}) => isOwn)
    .map(({layer}) => layer)].flatMap(({children}) => children);
  for (const layer of layers) {
    if ([...GROUND, ...SEE_THROUGH].includes(layer.name)) continue;
    layer.traverse(({geometry}) => {
      if (!geometry?.index) return;
      const {array} = geometry.attributes.position;
      const triangles = geometry.index.array;
      for (let at = 0; at < triangles.length; at += 3) {
        for (let k = 0; k < 9; ++k) {
          points[k] = array[3 * triangles[at + Math.floor(k / 3)] + k % 3];
        }
        cover(points);
      }
    });
  }
  // Surfaces count a cell wider on all sides.
  const beside = [-1, 0, 1].flatMap((k) => [-1, 0, 1].map(
    (i) => k * columns + i));
  roofs = {low, high, columns, tops: tops.map((_, cell) => Math.max(
    ...beside.map((step) => tops[cell + step] ?? -Infinity)))};

  // Samples a triangle, less than a cell apart.
  function cover([ax, ay, az, bx, by, bz, cx, cy, cz]) {
    if (Math.max(ax, bx, cx) < low[0] || Math.min(ax, bx, cx) > high[0]
      || Math.max(ay, by, cy) < low[1]
      || Math.min(ay, by, cy) > high[1]) return;
    const n = Math.ceil(1.5 * Math.max(0.1, Math.hypot(bx - ax, by - ay),
      Math.hypot(cx - ax, cy - ay), Math.hypot(cx - bx, cy - by)));
    for (let i = 0; i <= n; ++i) {
      for (let k = 0; k <= n - i; ++k) {
        const z = az + ((bz - az) * i + (cz - az) * k) / n;
        const x = Math.floor(
          ax + ((bx - ax) * i + (cx - ax) * k) / n - low[0]);
        const y = Math.floor(
          ay + ((by - ay) * i + (cy - ay) * k) / n - low[1]);
        const cell = y * columns + x;
        if (x >= 0 && x < columns && tops[cell] < z) tops[cell] = z;
      }
    }
  }
}

// Whether the car at a position is seen from another one. What is within 3 m of
// it, such as a bridge over it, does not count.
function isSeen(position, from) {
  const {low, high, columns, tops} = roofs;
  const length = Math.hypot(from.x - position.x, from.z - position.z);
  for (let way = 3; way < length; way += 0.5) {
    const share = way / length;
    const x = position.x + share * (from.x - position.x);
    const y = -position.z - share * (from.z - position.z);
    if (x < low[0] || x >= high[0] || y < low[1] || y >= high[1]) return true;
    const height = position.y + 1 + share * (from.y - position.y - 1);
    const cell = Math.floor(y - low[1]) * columns + Math.floor(x - low[0]);
    if (tops[cell] > height) return false;
  }
  return true;
}

// The view that the user chose: the camera seen from its target, and the target
// seen from the car, both turning with the car; and the polar angle `phi` at
// which the camera is: smaller than the chosen one where the camera rises.
let chosen = null;
// Time in steps -> by how much the chosen view must rise there [rad].
const rises = new Map();
const STEP = 0.25;
const STEPS = 4;

function seenFromCar(point, {position, heading}) {
  return point.clone().sub(position).applyAxisAngle(UP, -heading);
}

function seenFromWorld(point, {position, heading}) {
  return point.clone().applyAxisAngle(UP, heading).add(position);
}

function cameraAt(phi) {
  const {arm, target} = chosen;
  return new MeshCat.THREE.Vector3().setFromSphericalCoords(
    arm.radius, phi, arm.theta).add(target);
}

function neededRise(step) {
  if (rises.has(step)) return rises.get(step);
  const interval = track.length > 1 ? track[1].time - track[0].time : 1;
  const index = Math.round(step * STEP / interval);
  const {place: [x, y, z], heading} =
    track[Math.min(Math.max(index, 0), track.length - 1)];
  const pose = {position: new MeshCat.THREE.Vector3(x, z, -y), heading};
  let phi = chosen.arm.phi;
  while (phi > 0.09
    && !isSeen(pose.position, seenFromWorld(cameraAt(phi), pose))) phi -= 0.01;
  // In a hall, nothing helps.
  rises.set(step, phi > 0.09 ? chosen.arm.phi - phi : 0);
  return rises.get(step);
}

// Depends on the time alone, and changes gently: the greatest rise within 1 s,
// averaged over another second.
function riseAt(time) {
  const middle = time / STEP;
  let [sum, weights] = [0, 0];
  for (let k = Math.ceil(middle - STEPS); k <= middle + STEPS; ++k) {
    let most = 0;
    for (let j = k - STEPS - 1; j <= k + STEPS + 1; ++j) {
      most = Math.max(most, neededRise(j));
    }
    const weight = STEPS + 0.1 - Math.abs(k - middle);
    sum += weight * most;
    weights += weight;
  }
  return sum / weights;
}

// Camera and target move and turn with the car, so that the user can look at
// the car from all sides. Where a building would hide it, the camera rises.
function follow() {
  const target = seenFromCar(viewer.controls.target, followed);
  const arm = new MeshCat.THREE.Spherical().setFromVector3(
    seenFromCar(viewer.camera.position, followed).sub(target));
  const turned = chosen && arm.phi - chosen.phi;
  if (!chosen || Math.hypot(turned, Math.sin(arm.theta - chosen.arm.theta),
    arm.radius - chosen.arm.radius, target.distanceTo(chosen.target)) > 1e-3) {
    if (chosen) arm.phi = Math.min(chosen.arm.phi + turned, Math.PI - 0.01);
    chosen = {arm, target};
    rises.clear();
  }
  // Of two drives, the one that leads decides for both.
  const rise = parent === window || leads ? riseAt(animator.time) : 0;
  chosen.phi = chosen.arm.phi - rise;
  followed = carPose();
  look(seenFromWorld(cameraAt(chosen.phi), followed),
    seenFromWorld(chosen.target, followed));
}

function setFollowing(on) {
  byId("follow").textContent = on ? "Whole city" : "Back to the car";
  // Near the car, the marker and the route hide other things.
  show("vehicle", "marker")(!on);
  viewer.set_property(["route"], "opacity", on ? 0.35 : 1);
  if (on) {
    overview = [viewer.camera.position.clone(), viewer.controls.target.clone()];
    followed = carPose();
    chosen = null;
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
const hole = {
  holeCar: {value: new MeshCat.THREE.Vector3()}, holeRadius: {value: 0}};
const GROUND = ["road", "parking", "sidewalk", "other-ground", "terrain"];
const HOLE = `
  uniform vec3 holeCar;
  uniform float holeRadius;
  void main() {
    if (vViewPosition.z < -holeCar.z - 3.0) {
      float grain = fract(52.98 * fract(
        dot(gl_FragCoord.xy, vec2(0.0671, 0.0058))));
      vec2 off = -vViewPosition.xy / vViewPosition.z + holeCar.xy / holeCar.z;
      if (length(off) < holeRadius * (0.8 + 0.2 * grain)) discard;
    }`;

function makeHole(material) {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, hole);
    shader.fragmentShader =
      shader.fragmentShader.replace("void main() {", HOLE);
  };
  material.needsUpdate = true;
}

function placeHole() {
  const {camera} = viewer;
  camera.updateMatrixWorld();
  const place = hole.holeCar.value.copy(carPose().position)
    .applyMatrix4(camera.matrixWorldInverse);
  hole.holeRadius.value = Math.max(7 / Math.max(-place.z, 7), 0.035);
}

// What is far away fades into the horizon.
const fog = new MeshCat.THREE.Fog(0xa6c6f0);
viewer.scene.fog = fog;

function placeFog() {
  const away = viewer.camera.position.distanceTo(viewer.controls.target);
  outlineScreen.value.set(innerWidth, innerHeight).divideScalar(OUTLINE);
  fog.near = 150 + 2 * away;
  fog.far = 6 * fog.near;
}

// What only one side has is outlined: copies of it of one colour, a little behind
// it, and a little to all sides on the screen [px].
const OUTLINE = 2;
const outlineScreen = {value: new MeshCat.THREE.Vector2(1, 1)};
const outlines = [];

function outline(layer, colour) {
  const meshes = [];
  layer.traverse((one) => { if (one.isMesh) meshes.push(one); });
  for (const [x, y] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const material = new MeshCat.THREE.ShaderMaterial({
      side: MeshCat.THREE.DoubleSide,
      uniforms: {
        ...hole,
        colour: {value: new MeshCat.THREE.Color(colour)},
        shift: {value: new MeshCat.THREE.Vector2(x, y)},
        screen: outlineScreen,
      },
      vertexShader: `
        uniform vec2 shift;
        uniform vec2 screen;
        varying vec3 vViewPosition;
        void main() {
          vec3 place = (modelViewMatrix * vec4(position, 1.0)).xyz;
          vViewPosition = -place;
          place *= 1.01 + 1.0 / length(place);
          gl_Position = projectionMatrix * vec4(place, 1.0);
          gl_Position.xy += 2.0 * shift / screen * gl_Position.w;
        }`,
      fragmentShader: `
        uniform vec3 colour;
        varying vec3 vViewPosition;
        ${HOLE}
          gl_FragColor = vec4(colour, 1.0);
          #include <colorspace_fragment>
        }`,
    });
    for (const mesh of meshes) {
      const copy = new MeshCat.THREE.Mesh(mesh.geometry, material);
      mesh.add(copy);
      outlines.push(copy);
    }
  }
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
  for (const copy of outlines) copy.visible = on;
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
      // The car drives through its own stage.
      clouds.visible = sides[k].isOwn;
      renderer.setScissor(x, 0, width, innerHeight);
      draw(scene, camera);
    }
    renderer.setScissorTest(false);
    for (const {layer, isOwn} of sides) layer.visible = isOwn;
    clouds.visible = true;
  };
}

// All points of a scan, from the page's own data, and the intensity and the
// kind of each. See `PackedScan` in Python.
async function unpack({dataset, textContent}) {
  const packed = await fetch(
    "data:application/octet-binary;base64," + textContent);
  const planes = new Uint8Array(await new Response(packed.body.pipeThrough(
    new DecompressionStream("deflate"))).arrayBuffer());
  const origin = dataset.origin.split(",").map(Number);
  const grid = Number(dataset.grid);
  const count = planes.length / 8;
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
  const marks = planes.subarray(6 * count);
  for (let k = 1; k < 2 * count; ++k) {
    if (k !== count) marks[k] += marks[k - 1];
  }
  return {
    points, intensities: marks.subarray(0, count), kinds: marks.subarray(count)};
}

const scans = [...document.querySelectorAll("script.scan")];
const times = scans.map(({dataset}) => Number(dataset.time));
// Index of a scan near the play head -> its cloud, null while it is decoded.
const nearScans = new Map();
const clouds = new MeshCat.THREE.Group();
node("scans").object.add(clouds);
const menu = byId("points");
// Points are drawn a little nearer than the surfaces on which they lie. Those of
// the latest scan are larger.
const [earlierPoints, latestPoints] = [2, 3.2].map((size) => {
  const material = new MeshCat.THREE.PointsMaterial(
    {size, sizeAttenuation: false, vertexColors: true});
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      "#include <project_vertex>",
      `#include <project_vertex>
      gl_Position = projectionMatrix * vec4(0.99 * mvPosition.xyz, 1.0);`);
  };
  return material;
});
// How much of the past is shown [s], and in how many scans at most.
const PAST = 3;
let mostScans = 12;

// What gives a point its colour -> which of the colours: 0 is the first, 1 the
// last.
const {lowest, highest} = menu.dataset;
const LEVELS = {
  height: ({points}, k) => (points[3 * k + 2] - lowest) / (highest - lowest),
  intensity: ({intensities}, k) => intensities[k] / 63,
  class: ({kinds}, k, last) => (kinds[k] & 127) / last,
  change: ({kinds}, k) => kinds[k] >> 7,
};

function colourCloud({userData, geometry}) {
  const level = LEVELS[menu.value];
  if (!level) return;
  const scale = menu.selectedOptions[0].dataset.colours.split(",").map(
    (one) => new MeshCat.THREE.Color(one));
  const last = scale.length - 1;
  const colours = new Float32Array(userData.points.length);
  const colour = new MeshCat.THREE.Color();
  for (let k = 0; k < userData.kinds.length; ++k) {
    const at = last * Math.min(Math.max(level(userData, k, last), 0), 1);
    const below = Math.min(Math.floor(at), last - 1);
    colour.lerpColors(scale[below], scale[below + 1], at - below)
      .toArray(colours, 3 * k);
  }
  geometry.setAttribute("color", new MeshCat.THREE.BufferAttribute(colours, 3));
}

function setColours() {
  show("scans")(Boolean(menu.value));
  for (const key of document.querySelectorAll(".key")) {
    key.hidden = key.dataset.of !== menu.value;
  }
  for (const cloud of nearScans.values()) if (cloud) colourCloud(cloud);
  viewer.set_dirty();
}

async function decode(index) {
  nearScans.set(index, null);
  const scan = await unpack(scans[index]);
  if (!nearScans.has(index)) return;
  const {BufferAttribute, BufferGeometry, Points} = MeshCat.THREE;
  const cloud = new Points(new BufferGeometry().setAttribute(
    "position", new BufferAttribute(scan.points, 3)), earlierPoints);
  cloud.frustumCulled = false;
  cloud.userData = scan;
  colourCloud(cloud);
  clouds.add(cloud);
  nearScans.set(index, cloud);
  // The legend has the classes that were seen.
  const classes = document.querySelectorAll('.key[data-of="class"] span');
  for (const kind of new Set(scan.kinds)) classes[kind & 127].hidden = false;
  viewer.set_dirty();
}

// Shows the scans of the last seconds; decodes the next ones, and forgets the
// others.
function showScans() {
  if (!scans.length) return Promise.resolve();
  const now = animator.time + 1e-3;
  const latest = Math.max(times.findLastIndex((time) => time <= now), 0);
  const first = times.findIndex((time) => time > now - PAST);
  const step = Math.ceil((latest - first + 1) / mostScans);
  const shown = (k) => k === latest || (k >= first && k < latest && k % step === 0);
  const wanted = [...scans.keys()].filter(
    (k) => shown(k) || (k > latest && k <= latest + 2));
  for (const [k, cloud] of nearScans) {
    if (cloud) {
      cloud.visible = shown(k);
      cloud.material = k === latest ? latestPoints : earlierPoints;
    }
    if (wanted.includes(k)) continue;
    cloud?.removeFromParent();
    cloud?.geometry.dispose();
    nearScans.delete(k);
  }
  return Promise.all(
    wanted.filter((k) => !nearScans.has(k)).map((k) => decode(k)));
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

// Buttons that go to the greatest changes, in order of time.
const places = [...document.querySelectorAll("#places [data-time]")].map(
  (button) => ({button, time: Number(button.dataset.time)}));

// Goes to the car before a change, and looks from there at the side of the
// divider that has it.
function goTo({button, time}) {
  if (!followed) setFollowing(true);
  setTime(time);
  const [x, y] = button.dataset.place.split(",").map(Number);
  const {position} = followed = carPose();
  const way = new MeshCat.THREE.Vector3(x, 0, -y).sub(position).setY(0);
  const far = viewer.camera.aspect < 1 ? 1.5 : 1;
  chosen = null;
  look(
    way.clone().setLength(-25 * far).add(position).setY(position.y + 14 * far),
    way.clone().clampLength(0, 5).add(position));
  placeDivider(innerWidth * (button.dataset.side === "after" ? 0.35 : 0.65));
}

// Says which change the car passes.
function showPlace() {
  const now = places.findLast(({time}) => time <= animator.time + 1e-3
    && animator.time < time + 8);
  for (const one of places) one.button.ariaCurrent = one === now;
  if (byId("place")) byId("place").value = now?.button.title ?? "";
}

// Motion begins when there are points. Where pictures take long, such as on a
// slow phone, there are fewer points, and the car stands until it is told to go.
async function begin() {
  animator.pause();
  if (places.length && parent === window) goTo(places[0]);
  else setTime(0);
  await showScans();
  const picture = () => new Promise((drawn) => requestAnimationFrame(() => {
    viewer.render();
    drawn();
  }));
  await picture();
  const start = performance.now();
  await picture();
  await picture();
  byId("loading").remove();
  if (performance.now() - start > 500) {
    viewer.renderer.setPixelRatio(1);
    mostScans = 6;
  } else if (parent === window || leads) {
    animator.play();
  }
  viewer.set_dirty();
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

// Where the car is at each frame of the animation, [x, y, z] in the world W,
// its heading, and the frame's time.
function carTrack() {
  const {tracks} = animator.actions.find(
    (action) => action.getRoot() === car).getClip();
  const [places, turns] = ["position", "quaternion"].map(
    (end) => tracks.find(({name}) => name.endsWith(end)));
  return [...places.times].map((time, k) => {
    const [x, y, z, w] = turns.values.slice(4 * k, 4 * k + 4);
    return {
      time,
      place: places.values.slice(3 * k, 3 * k + 3),
      heading: Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    };
  });
}

// In a page of two drives, one leads: the first, or the one that the user
// touched last. The other one goes to the same place, and its camera looks from
// the same side.
let leads = window.name === "leader";
let track = null;
// When the latest message was sent, or this page was touched [ms].
let heard = 0;
const present = () => performance.timeOrigin + performance.now();

function tell() {
  if (!leads) return;
  const {camera, controls} = viewer;
  const {position, heading} = carPose();
  const seen = (point) => (followed
    ? point.clone().sub(position).applyAxisAngle(UP, -heading)
    : point.clone()).toArray();
  parent.postMessage({
    sent: present(),
    place: car.position.toArray(),
    follows: Boolean(followed),
    camera: seen(camera.position),
    target: seen(controls.target),
  }, "*");
}

function listen({data}) {
  // Messages can overtake each other.
  if (data.sent < heard) return;
  heard = data.sent;
  leads = false;
  if (animator.playing) animator.pause();
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
  chosen = null;
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
  placeFog();
  tell();
  showTime();
  showScans();
  showPlace();
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
  for (const side of sides) {
    side.isOwn = side.layer.visible;
    if (divider) outline(side.layer, side.colour);
  }
  divide(viewer.renderer);
  track = carTrack();
  readRoofs();
  byId("time").max = animator.duration;
  byId("time").addEventListener("input", (event) => {
    setTime(Number(event.target.value));
  });
  byId("play").addEventListener("click", () => {
    if (animator.playing) animator.pause();
    else animator.play();
    showTime();
  });
  byId("follow").addEventListener("click", () => setFollowing(!followed));
  menu.addEventListener("change", setColours);
  for (const one of places) {
    one.button.addEventListener("click", () => goTo(one));
  }
  byId("unfold")?.addEventListener("click", () => {
    byId("plots").hidden = !byId("plots").hidden;
    byId("unfold").ariaExpanded = !byId("plots").hidden;
    centre();
  });
  connectSwitch("change", setDivided);
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
  fold(true);
  setColours();
  if (parent !== window) {
    for (const kind of ["pointerdown", "keydown", "wheel"]) {
      addEventListener(kind, () => {
        leads = true;
        heard = present();
      }, {capture: true});
    }
    addEventListener("message", listen);
  }
  // On a narrow screen, the camera must be farther away to show the city.
  const {camera, controls} = viewer;
  const farther = Math.max(1, 1.2 / camera.aspect);
  look(camera.position.clone().sub(controls.target).multiplyScalar(farther)
    .add(controls.target), controls.target.clone());
  setFollowing(true);
  if (divider) {
    byId("change").checked = parent === window;
    setDivided(parent === window);
  }
  return begin();
});
