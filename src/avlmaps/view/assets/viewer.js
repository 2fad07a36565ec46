// The picture: layers, lines and marks under one camera, on one, two or a divided field.

const REST_MS = 140;
const FLIGHT_MS = 600;
const SAVED_PIXELS = 3840; // width of a picture that is saved
const PATH_TINT = [0.12, 0.44, 0.75];
const INK_TINT = [0.09, 0.1, 0.11];
const SOURCE_TINTS = { 0.5: [0.7, 0.26, 0.06], 0.9: [0.95, 0.6, 0.32] };

/** A band over the floor along a path. */
function band(places, width) {
  const strip = [];
  for (let i = 0; i < places.length; i++) {
    const before = places[Math.max(0, i - 1)];
    const after = places[Math.min(places.length - 1, i + 1)];
    const way = unit([after[0] - before[0], after[1] - before[1], 0]);
    const side = [(-way[1] * width) / 2, (way[0] * width) / 2, 0];
    strip.push(...add(places[i], side), ...sub(places[i], side));
  }
  return new Float32Array(strip);
}

/** The edges of a box. */
function boxEdges(low, high) {
  const corner = (k) => [k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]];
  const edges = [];
  for (let k = 0; k < 8; k++) {
    for (const bit of [1, 2, 4]) if (!(k & bit)) edges.push(...corner(k), ...corner(k | bit));
  }
  return new Float32Array(edges);
}

/** What a camera sees, as lines from its place to the corners of its picture. */
function cameraEdges(frame, [width, height]) {
  const depth = 0.5;
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) =>
    add(frame.position, scaled(add(frame.ahead, add(scaled(frame.right, (u * width) / 2),
      scaled(frame.down, (v * height) / 2))), depth)));
  const edges = corners.flatMap((corner, k) => [...frame.position, ...corner, ...corner, ...corners[(k + 1) % 4]]);
  return new Float32Array(edges);
}

class Viewer {
  constructor(canvas, overlay, told) {
    this.canvas = canvas;
    this.renderer = new Renderer(canvas);
    this.camera = new Camera();
    this.look = { colour: "picture", cut: [-Infinity, Infinity], heights: [0, 2.5], hottest: 1,
      background: [0.9, 0.9, 0.88] };
    this.arrangement = "beside";
    this.divide = 0.5;
    this.fields = told.maps.map((map) => {
      const layer = new Layer(this.renderer.gl, map);
      layer.setPalettes(told.palettes);
      const box = document.createElement("div");
      box.className = "marks";
      overlay.append(box);
      return { map, layer, marks: new Marks(box), lines: new Map() };
    });
    this.onClick = () => {};
    this.onMove = () => {};
    this.waiting = false;
    this.whole = null; // the view that was fitted to the picture last
    steer(canvas, this.camera, () => {
      this.flight = null;
      this.moved();
    }, (x, y) => this.clicked(x, y));
    new ResizeObserver(() => this.resized()).observe(canvas);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.changed());
  }

  /** The whole of what is shown: from above its side, or as a plan. */
  frameAll(asPlan = false) {
    const lows = this.fields.map(({ map }) => map.least);
    const highs = this.fields.map(({ map }) => [map.most[0], map.most[1], Math.min(map.most[2], map.ceiling_m)]);
    const least = lows.reduce((a, b) => a.map((value, k) => Math.min(value, b[k])));
    const most = highs.reduce((a, b) => a.map((value, k) => Math.max(value, b[k])));
    const [field] = this.places();
    this.flight = null;
    if (asPlan) this.camera.frameAbove(least, most, field.aspect);
    else this.camera.frame(least, most, field.aspect);
    this.whole = { asPlan, view: this.camera.saved() };
    this.moved();
  }

  /** The picture has another shape: a whole map that nobody has moved since stays whole. */
  resized() {
    if (this.whole && `${this.camera.saved()}` === `${this.whole.view}`) this.frameAll(this.whole.asPlan);
    else this.moved();
  }

  /** Where each field lies on the canvas: in CSS pixels from the top left, and in those of WebGL. */
  places() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = this.canvas.width / Math.max(1, width);
    return this.fields.map((field, k) => {
      const two = this.fields.length === 2;
      const beside = two && this.arrangement === "beside";
      const tall = beside && height > width * 1.1;
      const seen = beside ? (tall ? [width, height / 2] : [width / 2, height]) : [width, height];
      const origin = beside ? (tall ? [0, (k * height) / 2] : [(k * width) / 2, 0]) : [0, 0];
      const split = Math.round(width * this.divide);
      const cut = two && !beside ? (k ? [split, 0, width - split, height] : [0, 0, split, height]) : [...origin, ...seen];
      const inWebgl = ([x, y, w, h]) =>
        [x, height - y - h, w, h].map((value) => Math.round(value * ratio));
      return {
        aspect: Math.max(0.1, seen[0] / Math.max(1, seen[1])), field, k,
        viewport: inWebgl([...origin, ...seen]), scissor: inWebgl(cut),
        box: { left: cut[0], top: cut[1], width: cut[2], height: cut[3], x: origin[0] - cut[0], y: origin[1] - cut[1],
          seenWidth: seen[0], seenHeight: seen[1] },
      };
    });
  }

  setLines(k, name, lines) {
    if (lines) this.fields[k].lines.set(name, lines);
    else this.fields[k].lines.delete(name);
    this.changed();
  }

  /** The camera moved. */
  moved() {
    this.movedAt = performance.now();
    this.changed();
  }

  /** Something else is to be drawn. */
  changed() {
    this.dirty = true;
    this.canvas.dataset.state = "moving";
    this.renderer.rest = null;
    this.schedule();
  }

  schedule() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    if (this.renderer.busy()) return this.schedule();
    this.renderer.resize();
    const colour = getComputedStyle(this.canvas).backgroundColor.match(/[\d.]+/g) ?? [230, 230, 225];
    this.look.background = colour.slice(0, 3).map((value) => value / 255);
    const views = this.places().map((place) => ({
      ...place, layer: place.field.layer, camera: this.camera.seen(place.aspect),
      lines: [...place.field.lines.values()].flat(),
    }));
    if (this.dirty) {
      this.dirty = false;
      this.resting = true;
      this.renderer.drawMoving(views, this.look);
      for (const view of views) view.field.marks.update(view.camera, view.box, this.look.cut);
      this.onMove(views[0].box.seenHeight);
      return this.schedule();
    }
    if (!this.resting) return undefined;
    if (performance.now() - (this.movedAt ?? 0) < REST_MS) return this.schedule();
    this.resting = this.renderer.drawResting(views, this.look);
    this.canvas.dataset.state = this.resting ? "resting" : "whole";
    return this.resting ? this.schedule() : undefined;
  }

  /** Which field and which voxel lie under a place of the canvas. */
  under(x, y) {
    const place = this.places().find(({ box }) =>
      x >= box.left && x < box.left + box.width && y >= box.top && y < box.top + box.height);
    if (!place) return null;
    const { box, aspect, field, k } = place;
    const u = (2 * (x - box.left - box.x)) / box.seenWidth - 1;
    const v = 1 - (2 * (y - box.top - box.y)) / box.seenHeight;
    const { from, along } = this.camera.ray(aspect, u, v);
    const hit = field.layer.pick(from, along, this.look.cut);
    return hit && { k, ...hit };
  }

  clicked(x, y) {
    const hit = this.under(x, y);
    if (hit) this.onClick(hit);
  }

  /** Fly near to a place; at once where a person wants no motion. */
  flyTo(place, distance = 3.5) {
    const { target, distance: away } = this.camera;
    const begun = performance.now();
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const flight = (this.flight = {});
    const step = () => {
      if (this.flight !== flight) return;
      const share = still ? 1 : Math.min(1, (performance.now() - begun) / FLIGHT_MS);
      const eased = share * share * (3 - 2 * share);
      this.camera.target = mix(target, place, eased);
      this.camera.distance = away + (Math.min(away, distance) - away) * eased;
      this.moved();
      if (share < 1) requestAnimationFrame(step);
    };
    step();
  }

  /** Put another state of a map in the place of the one that is shown. */
  replace(k, map, layer) {
    this.fields[k].layer.free();
    Object.assign(this.fields[k], { map, layer });
    if (this.whole && `${this.camera.saved()}` === `${this.whole.view}`) this.frameAll(this.whole.asPlan);
    else this.changed();
  }

  /** Draw the whole picture large, and give it to `use` before the page's own size is back. */
  async drawnLarge(use) {
    const most = this.renderer.gl.getParameter(this.renderer.gl.MAX_RENDERBUFFER_SIZE);
    const { clientWidth, clientHeight } = this.canvas;
    const own = Math.min(window.devicePixelRatio || 1, 2);
    const scale = Math.max(own, Math.min(SAVED_PIXELS, most) / Math.max(clientWidth, clientHeight));
    try {
      this.renderer.scale = scale;
      this.changed();
      while (this.canvas.dataset.state !== "whole") await new Promise(requestAnimationFrame);
      return await use();
    } finally {
      this.renderer.scale = null;
      this.changed();
    }
  }
}
