// Connects the panels with the scene. `viewer` is Meshcat's viewer; `commands`
// is a promise of the scene's commands.

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
  // Near the car, the marker and the route hide other things, and points look
  // smaller.
  show("vehicle", "marker")(!on);
  viewer.set_property(["route"], "opacity", on ? 0.4 : 1);
  node("scans").object.traverse(({material}) => {
    if (material) material.size = on ? 4 : 2;
  });
  if (on) {
    overview = [viewer.camera.position.clone(), viewer.controls.target.clone()];
    followed = carPose();
    const fromCar = (x, y) => new MeshCat.THREE.Vector3(x, y, 0)
      .applyAxisAngle(UP, followed.heading).add(followed.position);
    look(fromCar(-18, 7), fromCar(2, 0));
  } else {
    followed = null;
    look(...overview);
  }
}

function setChanged(on) {
  document.body.classList.toggle("changed", on);
  for (const name of ["absent", "lower"]) show("stage_difference", name)(on);
  node("stage_difference", "additional").object.traverse(({material}) => {
    if (!material) return;
    material.vertexColors = !on;
    material.color.set(on ? byId("change").dataset.additional : "white");
    material.needsUpdate = true;
  });
  viewer.set_dirty();
}

// Parts that the other stage lacks are also switched with the city.
function setCity(on) {
  for (const path of [["city"], ["stage_difference", "additional"]]) {
    show(...path)(on);
  }
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
  showTime();
  showImages();
};

// Colours as given, instead of the tone mapping of a film.
viewer.renderer.toneMapping = MeshCat.THREE.NeutralToneMapping;

// While the scene loads, no pictures are drawn, which would slow down loading.
const drawPicture = viewer.animate;
viewer.animate = () => {};

commands.then(() => {
  viewer.animate = drawPicture;
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
  connectSwitch("change", setChanged);
  connectSwitch("points", show("scans"));
  connectSwitch("route", show("route"));
  connectSwitch("moving", show("moving"));
  connectSwitch("city", setCity);
  connectSwitch("images", (on) => {
    byId("cameras").hidden = !on;
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
  fold(innerWidth <= 640);
  // On a narrow screen, the camera must be farther away to show the city.
  const {camera, controls} = viewer;
  const farther = Math.max(1, 1.2 / camera.aspect);
  look(camera.position.clone().sub(controls.target).multiplyScalar(farther)
    .add(controls.target), controls.target.clone());
});
