// Draws the voxels of one or two maps, and lines. While the view moves it draws as many voxels as it has time for; once
// the view rests it draws all of them, part by part, beside the picture that is shown, and then shows that.

const FRAME_MS = 45; // a moving picture should take no longer
const FIRST_BUDGET = 120000;
const LEAST_BUDGET = 15000;
const RESTING = 3; // a part of a picture at rest may take this many times longer

function compiled(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const places = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    places[name] = gl.getUniformLocation(program, name);
  }
  return { program, places };
}

/** The voxels of one map on the graphics card. */
class Layer {
  constructor(gl, map) {
    this.gl = gl;
    this.map = map;
    this.count = map.voxels;
    this.loaded = 0;
    this.levelFromCells = fromRows(map.level_from_cells);
    this.cellsFromLevel = invertedPose(this.levelFromCells);
    this.records = new Uint8Array(this.count * map.record_bytes);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const size = map.record_bytes;
    this.recordBuffer = this.filled(this.records.length, [[0, 3, gl.UNSIGNED_SHORT, false, size, 0],
      [1, 3, gl.UNSIGNED_BYTE, true, size, 8]]);
    this.labelBuffer = this.filled(4 * this.count, [[2, 4, gl.UNSIGNED_BYTE, false, 4, 0]]);
    this.heatBuffer = this.filled(this.count, [[3, 1, gl.UNSIGNED_BYTE, true, 1, 0]]);
    gl.bindVertexArray(null);
    this.palette = gl.createTexture();
  }

  filled(bytes, attributes) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, Math.max(bytes, 4), gl.DYNAMIC_DRAW);
    for (const [place, ...layout] of attributes) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, ...layout);
    }
    return buffer;
  }

  put(buffer, bytes, start = 0) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, start, bytes);
  }

  /** Take the next part of the voxels. */
  addRecords(bytes, start) {
    this.records.set(bytes, start);
    this.put(this.recordBuffer, bytes, start);
    this.loaded = Math.floor((start + bytes.length) / this.map.record_bytes);
  }

  setLabels(bytes) {
    this.labels = bytes;
    this.put(this.labelBuffer, bytes);
  }

  /** Free what it holds on the graphics card. */
  free() {
    for (const buffer of [this.recordBuffer, this.labelBuffer, this.heatBuffer]) this.gl.deleteBuffer(buffer);
    this.gl.deleteVertexArray(this.array);
    this.gl.deleteTexture(this.palette);
  }

  setHeat(bytes) {
    this.put(this.heatBuffer, bytes);
  }

  /** Four rows of 256 colours: things, rooms, height, heat. */
  setPalettes(palettes) {
    const { gl } = this;
    const rows = ["thing", "room", "height", "heat"].flatMap((name) => palettes[name]);
    gl.bindTexture(gl.TEXTURE_2D, this.palette);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, 256, 4, 0, gl.RGB, gl.UNSIGNED_BYTE, Uint8Array.from(rows));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }

  /** How large the voxels are drawn if only the first so many are: as large as the blocks that they stand for. */
  edgeFor(count) {
    const level = this.map.levels.find(([most]) => most >= count) ?? this.map.levels[this.map.levels.length - 1];
    return { block: level[1], edge: level[1] * Math.sqrt(level[0] / Math.max(count, 1)) };
  }

  /** The voxel that a ray from a place meets first, and how far along; level frame. */
  pick(from, along, cut) {
    const start = moved(this.cellsFromLevel, from);
    const slope = turned(this.cellsFromLevel, along).map((value) => 1 / (value || 1e-12));
    const words = new Uint16Array(this.records.buffer);
    const stride = this.map.record_bytes / 2;
    const m = this.levelFromCells;
    const { block } = this.edgeFor(this.loaded);
    let best = Infinity;
    let found = -1;
    for (let i = 0; i < this.loaded; i++) {
      let enter = 0;
      let leave = best;
      for (let axis = 0; axis < 3 && enter < leave; axis++) {
        const word = words[i * stride + axis];
        const low = (word - (word % block) - start[axis]) * slope[axis];
        const high = low + block * slope[axis];
        enter = Math.max(enter, Math.min(low, high));
        leave = Math.min(leave, Math.max(low, high));
      }
      if (enter >= leave || enter >= best) continue;
      const at = i * stride;
      const z = m[2] * (words[at] + 0.5) + m[6] * (words[at + 1] + 0.5) + m[10] * (words[at + 2] + 0.5) + m[14];
      if (z < cut[0] || z > cut[1]) continue;
      best = enter;
      found = i;
    }
    return found < 0 ? null : { number: found, away: best, place: add(from, scaled(along, best)) };
  }

  /** The middle of a voxel, level frame. */
  middle(number) {
    const words = new Uint16Array(this.records.buffer, number * this.map.record_bytes, 4);
    return moved(this.levelFromCells, [words[0] + 0.5, words[1] + 0.5, words[2] + 0.5]);
  }
}

class Renderer {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser offers no WebGL 2; open the page in a current Firefox, Chrome or Safari.");
    this.gl = gl;
    this.squares = compiled(gl, VOXEL_VERTEX, SQUARE_FRAGMENT);
    this.blocks = compiled(gl, VOXEL_VERTEX, BLOCK_FRAGMENT);
    this.lines = compiled(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.lineBuffer = gl.createBuffer();
    this.lineArray = gl.createVertexArray();
    this.budget = FIRST_BUDGET;
    this.frames = 0; // whole pictures shown
    this.frameMs = []; // of the latest moving pictures
    this.rest = null; // the picture that is being drawn at rest
    this.target = null;
    this.scale = null; // pixels of the picture for one of the page, where it is to be saved
  }

  resize() {
    const scale = this.scale ?? Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * scale));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    const { gl } = this;
    if (this.target) {
      gl.deleteTexture(this.target.colour);
      gl.deleteRenderbuffer(this.target.depth);
      gl.deleteFramebuffer(this.target.buffer);
    }
    this.target = { colour: gl.createTexture(), depth: gl.createRenderbuffer(), buffer: gl.createFramebuffer() };
    gl.bindTexture(gl.TEXTURE_2D, this.target.colour);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.target.depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.target.colour, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.target.depth);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.rest = null;
  }

  /** Whether the last picture is still being drawn; a new one would only queue up behind it. */
  busy() {
    if (!this.fence) return false;
    const state = this.gl.clientWaitSync(this.fence, 0, 0);
    if (state === this.gl.TIMEOUT_EXPIRED) return true;
    this.gl.deleteSync(this.fence);
    this.fence = null;
    const took = performance.now() - this.begun;
    if (this.wasMoving) {
      this.frameMs.push(took);
      if (this.frameMs.length > 120) this.frameMs.shift();
      const better = this.budget * Math.min(1.5, Math.max(0.5, FRAME_MS / Math.max(took, 4)));
      this.budget = Math.round(Math.max(LEAST_BUDGET, 0.5 * (this.budget + better)));
    }
    return false;
  }

  /** Draw a picture of a moving view, at once. */
  drawMoving(views, look) {
    this.rest = null;
    this.begin(null, look);
    for (const view of views) {
      const count = Math.min(view.layer.loaded, Math.max(LEAST_BUDGET, Math.round(this.budget / views.length)));
      this.voxels(this.squares, view, look, 0, count, view.layer.edgeFor(count), 1.25);
      this.drawLines(view);
    }
    this.end(true);
  }

  /** Draw the next part of a picture at rest; returns whether there is more to draw. */
  drawResting(views, look) {
    const { gl } = this;
    if (!this.rest) {
      this.rest = { at: 0 };
      this.begin(this.target.buffer, look);
    } else {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.buffer);
    }
    const most = Math.max(...views.map((view) => view.layer.loaded), 0);
    const part = Math.max(LEAST_BUDGET, Math.round((RESTING * this.budget) / views.length));
    for (const view of views) {
      const count = Math.min(part, view.layer.loaded - this.rest.at);
      const { block, edge } = view.layer.edgeFor(view.layer.loaded);
      if (count > 0) this.voxels(this.blocks, view, look, this.rest.at, count, { block, edge }, 1.75);
    }
    this.rest.at += part;
    const more = this.rest.at < most;
    if (!more) {
      for (const view of views) this.drawLines(view);
      const { width, height } = this.canvas;
      gl.disable(gl.SCISSOR_TEST);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.target.buffer);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
      gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
      this.rest = null;
      this.frames += 1;
    }
    this.end(false);
    return more;
  }

  begin(buffer, look) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.disable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(...look.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  end(moving) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.begun = performance.now();
    this.wasMoving = moving;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  place(view) {
    const { gl } = this;
    gl.viewport(...view.viewport);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...view.scissor);
  }

  voxels({ program, places }, view, look, start, count, { block, edge }, room) {
    const { gl } = this;
    const { layer, camera } = view;
    this.place(view);
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, layer.palette);
    const cellM = layer.map.voxel_size_m;
    gl.uniformMatrix4fv(places.levelFromCells, false, new Float32Array(layer.levelFromCells));
    gl.uniformMatrix4fv(places.clipFromLevel, false, new Float32Array(camera.clipFromLevel));
    gl.uniform1f(places.block, block);
    gl.uniform1f(places.cellM, cellM * room); // a point covers the block that it stands for, seen from any side
    gl.uniform1f(places.edge, edge);
    gl.uniform1f(places.pixels, 0.5 * view.viewport[3] / camera.slope);
    gl.uniform1f(places.mode, Math.max(0, COLOURS.indexOf(look.colour)));
    gl.uniform2f(places.cut, ...look.cut);
    gl.uniform2f(places.heights, ...look.heights);
    gl.uniform1f(places.hottest, look.hottest);
    gl.uniform1i(places.palette, 0);
    if (places.ray) {
      const columns = [scaled(camera.right, camera.slope * camera.aspect), scaled(camera.up, camera.slope), camera.ahead];
      gl.uniformMatrix3fv(places.ray, false, columns.flatMap((column) => turned(layer.cellsFromLevel, column)));
      gl.uniform3f(places.eye, ...moved(layer.cellsFromLevel, camera.eye));
      gl.uniform4f(places.viewport, ...view.viewport);
      gl.uniform1f(places.near, camera.near);
      gl.uniform1f(places.far, camera.far);
      gl.uniform1f(places.flatness, camera.flat ? 1 : 0);
    }
    gl.bindVertexArray(layer.array);
    gl.drawArrays(gl.POINTS, start, count);
    gl.bindVertexArray(null);
  }

  drawLines(view) {
    const { gl } = this;
    this.place(view);
    gl.useProgram(this.lines.program);
    gl.bindVertexArray(this.lineArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lineBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    gl.uniformMatrix4fv(this.lines.places.clipFromLevel, false, new Float32Array(view.camera.clipFromLevel));
    for (const { kind, places, tint, through } of view.lines) {
      gl.bufferData(gl.ARRAY_BUFFER, places, gl.DYNAMIC_DRAW);
      gl.uniform4f(this.lines.places.tint, ...tint, 1);
      if (through) gl.disable(gl.DEPTH_TEST);
      gl.drawArrays(kind === "band" ? gl.TRIANGLE_STRIP : gl.LINES, 0, places.length / 3);
      gl.enable(gl.DEPTH_TEST);
    }
    gl.bindVertexArray(null);
  }
}
