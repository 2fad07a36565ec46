// The eye: it turns about a place, with the mouse, fingers or keys. Level frame, z up.

const SLOPE = Math.tan((25 * Math.PI) / 180); // half the field of view, up and down
const STEEPEST = 1.555;
const FILLED = 0.88; // share of the picture's width and height that a whole map takes

class Camera {
  constructor() {
    this.target = [0, 0, 1];
    this.yaw = -2.2;
    this.pitch = 0.95;
    this.distance = 10;
    this.flat = false; // drawn without perspective, straight from above
  }

  /** Look at a whole map from above its side; all of it is in the picture. */
  frame(low, high, aspect) {
    const sides = sub(high, low);
    this.flat = false;
    this.yaw = sides[0] > sides[1] ? -Math.PI / 2 + 0.35 : 0.35;
    this.pitch = 0.95;
    this.fit(low, high, aspect);
  }

  /** Look at a whole map as a plan: from straight above, x to the right and y up, with one scale everywhere. */
  frameAbove(low, high, aspect) {
    this.flat = true;
    this.yaw = -Math.PI / 2;
    this.pitch = Math.PI / 2;
    this.fit(low, high, aspect);
  }

  /** Go as near as all corners of a box stay in the picture. */
  fit(low, high, aspect) {
    this.target = mix(low, high, 0.5);
    const { ahead, right, up } = this.look();
    this.distance = 0.15;
    for (let k = 0; k < 8; k++) {
      const corner = sub([k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]], this.target);
      const beyond = this.flat ? 0 : dot(corner, ahead);
      const wide = Math.max(Math.abs(dot(corner, right)) / aspect, Math.abs(dot(corner, up)));
      this.distance = Math.max(this.distance, wide / (FILLED * SLOPE) - beyond);
    }
  }

  look() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return { ahead: [-cp * cy, -cp * sy, -sp], right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp] };
  }

  /** All that drawing needs for a picture of some shape. */
  seen(aspect) {
    const { ahead, right, up } = this.look();
    // Without perspective the eye may be anywhere on its line: it is over everything.
    const away = this.flat ? this.distance + 400 : this.distance;
    const eye = sub(this.target, scaled(ahead, away));
    const near = Math.max(0.02, Math.min(0.3, this.distance * 0.05));
    const far = away + 400;
    const slope = this.flat ? SLOPE * this.distance : SLOPE; // half the picture's height, metres or metres a metre
    const view = Float64Array.of(
      right[0], up[0], -ahead[0], 0, right[1], up[1], -ahead[1], 0, right[2], up[2], -ahead[2], 0,
      -dot(right, eye), -dot(up, eye), dot(ahead, eye), 1,
    );
    const depth = this.flat
      ? [0, 0, 2 / (near - far), 0, 0, 0, (far + near) / (near - far), 1]
      : [0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
    const lens = Float64Array.of(1 / (slope * aspect), 0, 0, 0, 0, 1 / slope, 0, 0, ...depth);
    return { eye, ahead, right, up, near, far, slope, aspect, flat: this.flat, clipFromLevel: multiplied(lens, view) };
  }

  /** The ray through a place of the picture, given from -1 to 1 to the right and up: from where, and along what. */
  ray(aspect, u, v) {
    const { eye, ahead, right, up, slope, flat } = this.seen(aspect);
    const aside = add(scaled(right, u * slope * aspect), scaled(up, v * slope));
    return flat ? { from: add(eye, aside), along: ahead } : { from: eye, along: unit(add(ahead, aside)) };
  }

  /** How many pixels of a picture of some height a metre takes, in the middle of it. */
  pixelsOfMetre(height) {
    return height / (2 * SLOPE * this.distance);
  }

  /** The numbers that bring this view back. */
  saved() {
    return [this.yaw, this.pitch, this.distance, ...this.target, this.flat ? 1 : 0].map((value) => +value.toFixed(3));
  }

  /** Look as the numbers say; anything but seven numbers that make a view changes nothing. */
  restore([yaw, pitch, distance, x, y, z, flat, ...more]) {
    const numbers = [yaw, pitch, distance, x, y, z, flat];
    if (more.length || !numbers.every(Number.isFinite) || !(distance > 0) || Math.abs(pitch) > 1.58) return false;
    const straight = flat === 1;
    Object.assign(this, { yaw, pitch: straight ? Math.PI / 2 : pitch, distance, target: [x, y, z], flat: straight });
    this.zoom(1);
    return true;
  }

  turn(dx, dy) {
    this.flat = false;
    this.yaw -= dx;
    this.pitch = Math.min(STEEPEST, Math.max(-STEEPEST, this.pitch + dy));
  }

  /** Move sideways and up by parts of the picture's height. */
  pan(dx, dy) {
    const { right, up } = this.look();
    const size = 2 * SLOPE * this.distance;
    this.target = add(this.target, add(scaled(right, -dx * size), scaled(up, dy * size)));
  }

  /** Move over the floor. */
  walk(ahead, right) {
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    this.target = add(this.target, scaled([-c * ahead - s * right, -s * ahead + c * right, 0], 0.08 * this.distance));
  }

  zoom(factor) {
    this.distance = Math.min(500, Math.max(0.15, this.distance * factor));
  }

  /** Look as a robot's camera did. */
  standAt(frame) {
    this.flat = false;
    this.yaw = Math.atan2(-frame.ahead[1], -frame.ahead[0]);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, -frame.ahead[2])));
    this.distance = 0.5;
    this.target = add(frame.position, scaled(frame.ahead, 0.5));
  }
}

/** Let a canvas move the camera; `changed` is called after each move, `clicked(x, y)` for a click that is no drag. */
function steer(canvas, camera, changed, clicked) {
  const fingers = new Map();
  let travelled = 0;
  const size = () => Math.max(200, canvas.clientHeight);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (!fingers.size) travelled = 0;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    travelled += Math.abs(dx) + Math.abs(dy);
    if (fingers.size === 2) {
      const other = [...fingers].find(([id]) => id !== event.pointerId)[1];
      const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      camera.zoom(apart(before) / apart(now));
      camera.pan((0.5 * dx) / size(), (0.5 * dy) / size());
    } else if (event.shiftKey || event.buttons & 6) {
      camera.pan(dx / size(), dy / size());
    } else if (travelled > 4) {
      camera.turn((3.2 * dx) / size(), (3.2 * dy) / size());
    }
    fingers.set(event.pointerId, now);
    if (travelled > 4) changed();
  });
  const lifted = (event) => {
    const was = fingers.delete(event.pointerId);
    if (was && event.type === "pointerup" && travelled <= 4 && event.button === 0) {
      const box = canvas.getBoundingClientRect();
      clicked(event.clientX - box.left, event.clientY - box.top);
    }
  };
  canvas.addEventListener("pointerup", lifted);
  canvas.addEventListener("pointercancel", lifted);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(Math.max(-80, Math.min(80, event.deltaY)) * 0.0022));
    changed();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const keys = {
      ArrowLeft: () => camera.turn(-0.09, 0), ArrowRight: () => camera.turn(0.09, 0),
      ArrowUp: () => camera.turn(0, 0.07), ArrowDown: () => camera.turn(0, -0.07),
      w: () => camera.walk(1, 0), s: () => camera.walk(-1, 0), a: () => camera.walk(0, -1), d: () => camera.walk(0, 1),
      "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1.18),
      Enter: () => clicked(canvas.clientWidth / 2, canvas.clientHeight / 2),
    };
    const move = event.ctrlKey || event.metaKey || event.altKey ? null : keys[event.key];
    if (!move) return;
    event.preventDefault();
    move();
    changed();
  });
}
