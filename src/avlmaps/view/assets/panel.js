// The panel: what is asked, what is shown, and what came back, in words as well as in the picture.

const $ = (id) => document.getElementById(id);
const metres = (value) => `${value.toFixed(2)} m`;
const placeText = (place) => `(${place.map((value) => value.toFixed(2)).join(", ")}) m`;
const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
const percent = (share) => `${Math.round(100 * share)} %`;
const areaText = (room) => (room.area_m2 === null ? "" : ` · ${room.area_m2.toFixed(1)} m²`);

const RAYS = 8; // of each sound of a source

/** How well the place of a source is known, and what it may be. */
function sourceText(source) {
  const likely = [source.things[0], source.rooms[0]].filter(Boolean).map((one) => `${one.name} ${percent(one.probability)}`);
  return [`within ${metres(source.within_50_m)} with 50 %, ${metres(source.within_90_m)} with 90 %`, ...likely].join(" · ");
}

function made(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

const touched = window.matchMedia("(pointer: coarse)").matches;
const RETRIES = 8;
const CLICK = touched ? "Tap" : "Click";

class Panel {
  constructor(source, told) {
    this.source = source;
    this.told = told;
    this.maps = told.maps;
    this.contents = told.maps.map(() => null);
    this.files = {};
    this.viewer = new Viewer($("canvas"), $("overlay"), told);
    this.viewer.onClick = (hit) => this.clicked(hit);
    this.viewer.onMove = (height) => this.viewMoved(height);
    this.tape = [];
    this.question = "";
  }

  /** Fill the page: first the voxels, then what takes longer. */
  async start() {
    const names = this.maps.map((map) => map.name.replace(/\.avlmap$/, ""));
    $("name").textContent = names.join(" and ");
    this.summarise();
    document.title = `${names.join(" and ")} · avlmaps`;
    this.bindAsking();
    this.bindLook();
    this.bindPath();
    this.bindDrive();
    this.bindTools();
    $("voxel").replaceChildren(made("p", { className: "soft", textContent: `${CLICK} on the map.` }));
    this.viewer.frameAll();
    this.restore();
    window.addEventListener("hashchange", () => location.hash === Address.own || this.restore());
    try {
      await Promise.all(this.maps.map((_, k) => this.load(k)));
    } catch (fault) {
      if (!(await this.takenAgain())) {
        this.fault(fault);
        return;
      }
    }
    $("loading").hidden = true;
    this.drawPath();
    await Promise.all(this.maps.map((_, k) => this.fill(k).catch((fault) => this.note(fault.message))));
    document.documentElement.dataset.ready = "yes";
    if (this.source.live) this.source.watch(() => this.renew());
  }

  /** A map that grows may be another one by the time its voxels come: take it as it is then. */
  async takenAgain() {
    for (let tries = 0; this.source.live && tries < RETRIES; tries++) {
      if (await this.replaced([]).then(() => true, () => false)) return true;
    }
    return false;
  }

  /** Show the maps as they are now: they grew, were built again, or were edited. */
  async renew() {
    await this.replaced(this.source.versions);
    this.summarise();
    this.limits();
    this.drawPath();
    await Promise.all(this.maps.map((_, k) => this.fill(k)));
    document.documentElement.dataset.renewed = String(Number(document.documentElement.dataset.renewed ?? 0) + 1);
    if (this.question) await this.ask(this.question, false);
  }

  /** Take the voxels of each map that has another version than before. */
  async replaced(before) {
    const told = await this.source.describe();
    for (const [k, map] of told.maps.entries()) {
      if (this.source.versions[k] === before[k]) continue;
      const layer = new Layer(this.viewer.renderer.gl, map);
      layer.setPalettes(told.palettes);
      try {
        await this.source.voxels(k, (bytes, start) => layer.addRecords(bytes, start));
        if (layer.loaded !== layer.count) throw new Error("The map has grown meanwhile.");
      } catch (fault) {
        this.source.versions = before; // it changed meanwhile; the next look takes it
        layer.free();
        throw fault;
      }
      this.maps[k] = map;
      this.viewer.replace(k, map, layer);
    }
  }

  summarise() {
    const shown = (map) => map.voxels < map.voxels_of_map
      ? `${map.summary}; this file shows ${map.voxels.toLocaleString("en")} of them` : map.summary;
    $("summary").textContent = this.maps.map(shown).join("; ");
  }

  async load(k) {
    const { layer } = this.viewer.fields[k];
    let drawn = 0;
    await this.source.voxels(k, (bytes, start) => {
      layer.addRecords(bytes, start);
      if (layer.loaded < Math.min(layer.count, drawn * 1.6 + 4000)) return;
      drawn = layer.loaded;
      this.viewer.changed();
      document.documentElement.dataset.drawn ??= String(Math.round(performance.now()));
    });
    if (layer.loaded !== layer.count) throw new Error("The map has grown meanwhile.");
    this.viewer.changed();
  }

  async fill(k) {
    this.contents[k] = await this.source.contents(k);
    const { layer } = this.viewer.fields[k];
    this.alike();
    const labels = await this.source.labels(k);
    if (labels.length === 4 * layer.count) layer.setLabels(labels); // else the map has grown, and is taken again soon
    if (k === 0) this.list();
    for (const note of this.contents[k].notes) this.note(note);
    this.marks();
    this.legend();
    this.viewer.changed();
  }

  /** Give things and rooms of one name one colour in both maps. */
  alike() {
    const [first, ...others] = this.contents;
    for (const one of others) {
      if (!first || !one) continue;
      for (const [kind, names] of [["thing", "names"], ["room", "room_names"]]) {
        one[names].forEach((name, i) => {
          const same = first[names].indexOf(name);
          if (same < 0) return;
          const shade = first.palettes[kind].slice(3 * same + 3, 3 * same + 6);
          one.palettes[kind].splice(3 * i + 3, 3, ...shade);
        });
      }
    }
    this.contents.forEach((one, k) => one && this.viewer.fields[k].layer.setPalettes(one.palettes));
  }

  /** Bring back what the address says: the view, the cut, the question, the colours. */
  restore() {
    const { question, view, colour, cut } = Address.read();
    this.viewer.flight = null;
    if (view.length && this.viewer.camera.restore(view)) this.viewer.moved();
    if (cut.length === 2 && cut.every(Number.isFinite)) {
      [$("low").value, $("high").value] = cut;
      this.cut();
    }
    const known = [...$("colour").options].some((one) => one.value === colour);
    if (known) this.colourBy(colour);
    if (question) {
      $("sentence").value = question;
      this.ask(question, !known, !view.length);
    } else if (!this.source.live && this.told.questions.length) {
      this.ask(this.told.questions[0].question, false);
    }
  }

  /** The view moved: the scale is another one, and soon the address. */
  viewMoved(height) {
    const { camera } = this.viewer;
    const most = 120 / camera.pixelsOfMetre(height);
    const power = 10 ** Math.floor(Math.log10(most));
    const metre = power * [5, 2, 1].find((one) => one * power <= most);
    $("scale-bar").style.width = `${(metre * camera.pixelsOfMetre(height)).toFixed(1)}px`;
    $("scale-bar").dataset.metres = metre;
    const text = metre < 1 ? `${Math.round(100 * metre)} cm` : `${metre} m`;
    $("scale-text").textContent = text + (camera.flat ? "; x right, y up, level frame" : " in the middle of the picture");
    this.keep();
  }

  /** Write the state into the address once it rests. */
  keep() {
    clearTimeout(this.keeping);
    this.keeping = setTimeout(() => Address.write({
      question: this.question, view: this.viewer.camera.saved(), colour: $("colour").value,
      cut: this.isCut ? [Number($("low").value), Number($("high").value)] : [],
    }), 250);
  }

  async save() {
    const names = this.maps.map((map) => map.name.replace(/\.avlmap$/, ""));
    const asked = this.question && this.answers ? `: ${this.question}` : "";
    const caption = `${names.join(" and ")}${asked}. ${$("scale-text").textContent}`;
    const blob = await this.viewer.drawnLarge(() => pictureOf($("canvas"), $("stage"), caption));
    saveAs(blob, `${names.join("-")}.png`);
  }

  fault(fault) {
    $("loading").hidden = false;
    $("loading").classList.add("fault");
    $("loading").textContent = fault.message;
  }

  note(text) {
    const said = [...$("notes").children].some((one) => one.textContent === text);
    if (!said) $("notes").append(made("li", { textContent: text }));
  }

  toLevel(k, place) {
    return moved(fromRows(this.maps[k].level_from_recording), place);
  }

  // ---- asking ----

  bindAsking() {
    if (!this.source.live) {
      $("ask").hidden = true;
      $("drive-section").hidden = true;
      for (const { question } of this.told.questions) this.offer(question);
    }
    $("ask").addEventListener("submit", (event) => {
      event.preventDefault();
      if ($("sentence").value.trim() || Object.keys(this.files).length) this.ask($("sentence").value);
      else this.say("Write a question, or choose a photo or a sound.", "");
    });
    for (const kind of ["photo", "clip"]) {
      $(kind).addEventListener("change", () => this.give(kind, $(kind).files[0]));
    }
    $("clear").addEventListener("click", () => {
      $("sentence").value = "";
      for (const kind of ["photo", "clip"]) this.give(kind, null);
      this.forget();
    });
    document.addEventListener("keydown", (event) => {
      if (event.key !== "/" || /INPUT|SELECT|TEXTAREA/.test(document.activeElement?.tagName ?? "")) return;
      event.preventDefault();
      $("sentence").focus();
    });
    const stage = $("stage");
    stage.addEventListener("dragover", (event) => event.preventDefault());
    stage.addEventListener("drop", (event) => {
      event.preventDefault();
      const file = event.dataTransfer.files[0];
      if (!file || !this.source.live) return;
      this.give(file.type.startsWith("audio/") ? "clip" : "photo", file).then(() => this.ask($("sentence").value));
    });
  }

  offer(question) {
    const button = made("button", { type: "button", textContent: question });
    button.addEventListener("click", () => {
      $("sentence").value = question;
      this.ask(question);
    });
    $("questions").append(button);
  }

  /** Take a photo or a clip to ask with; null takes it away. */
  async give(kind, file) {
    const label = $(kind).closest("label");
    delete this.files[kind];
    if (!file) $(kind).value = "";
    label.classList.toggle("given", Boolean(file));
    label.firstChild.textContent = file ? file.name.slice(0, 18) : kind === "photo" ? "Photo" : "Sound";
    if (!file) return;
    try {
      this.files[kind] = await this.source.taken(kind, file);
      this.say(`${file.name} is ready; press Ask.`, "");
    } catch (fault) {
      await this.give(kind, null);
      this.say(fault.message, "fault");
    }
  }

  async ask(sentence, turnToHeat = true, fly = turnToHeat) {
    const number = (this.askedNumber = (this.askedNumber ?? 0) + 1);
    $("ask").querySelector(".main").disabled = true;
    try {
      const begun = performance.now();
      const told = await this.source.ask({ sentence, ...this.files });
      if (number !== this.askedNumber) return;
      let at = 0;
      for (const { layer } of this.viewer.fields) {
        layer.setHeat(told.heat.subarray(at, at + layer.count));
        at += layer.count;
      }
      this.answers = told.answers;
      this.question = this.files.photo || this.files.clip ? "" : sentence; // files are not kept
      this.keep();
      this.viewer.look.hottest = told.heat.reduce((a, b) => Math.max(a, b), 1) / 255;
      if (turnToHeat) this.colourBy("heat");
      this.showAnswer(sentence, told.answers, performance.now() - begun);
      const k = told.answers.findIndex((answer) => answer.found && answer.goals.length);
      if (fly && k >= 0) this.viewer.flyTo(this.toLevel(k, told.answers[k].goals[0].position), 5);
    } catch (fault) {
      this.forget();
      this.say(fault.message, "fault");
    } finally {
      $("ask").querySelector(".main").disabled = false;
    }
  }

  say(text, state) {
    $("answer").replaceChildren(made("p", { className: `verdict ${state}`, textContent: text }));
  }

  forget() {
    this.answers = null;
    this.question = "";
    this.keep();
    for (const { layer } of this.viewer.fields) layer.setHeat(new Uint8Array(layer.count));
    $("answer").replaceChildren();
    $("goals").replaceChildren();
    if ($("colour").value === "heat") this.colourBy("picture");
    this.marks();
    this.viewer.changed();
  }

  showAnswer(sentence, answers, tookMs) {
    $("answer").replaceChildren();
    $("goals").replaceChildren();
    if (this.maps.length > 1) {
      $("goals").append(made("p", { className: "warning soft", textContent: this.arePlaces() }));
    }
    answers.forEach((answer, k) => {
      const of = this.maps.length > 1 ? `${this.maps[k].name}: ` : "";
      const count = answer.count === undefined ? "" : ` ${answer.count} of them.`;
      const verdict = answer.found ? "Found." : "Not found here.";
      const texts = [made("p", { className: `verdict ${answer.found ? "found" : "lost"}`,
        textContent: `${of}${verdict}${count} ${answer.text}` })];
      for (const part of answer.parts) {
        const name = `${part.modality}: ${this.files[part.query]?.name ?? part.query}`;
        const taken = part.understood && part.understood !== part.query ? `, understood as ${part.understood}` : "";
        const state = part.found ? "found" : "not found";
        texts.push(made("p", { className: "soft", textContent: `${name}${taken} (${part.role}), ${state}` +
          (part.note ? `: ${part.note}` : "") }));
      }
      for (const note of answer.notes ?? []) texts.push(made("p", { className: "soft", textContent: note }));
      const others = (answer.found ? answer.alternatives ?? [] : []).filter((other) => other.found);
      if (others.length) {
        const named = others.map((other) => `${other.query} (${other.probability.toFixed(2)})`).join(", ");
        texts.push(made("p", { className: "soft", textContent: `Or: ${named}.` }));
      }
      $("answer").append(...texts);
      if (of) $("goals").append(made("h3", { textContent: `Goals in ${this.maps[k].name}` }));
      const label = of ? `Goals in ${this.maps[k].name}` : "Goals";
      $("goals").append(made("ol", { ariaLabel: label }, ...answer.goals.map((goal, i) => this.goalItem(k, goal, i))));
    });
    $("answer").append(made("p", { className: "soft", textContent: `${Math.round(tookMs)} ms` }));
    $("answer").dataset.question = sentence;
    this.marks();
    this.viewer.changed();
  }

  /** What to know of the goals of two maps. */
  arePlaces() {
    const [a, b] = this.maps;
    const meet = [0, 1].map((axis) => Math.min(a.high[axis], b.high[axis]) - Math.max(a.low[axis], b.low[axis]));
    const least = Math.min(...[a, b].map((map) => (map.high[0] - map.low[0]) * (map.high[1] - map.low[1])));
    const share = meet.every((side) => side > 0) ? (meet[0] * meet[1]) / least : 0;
    const first = share < 0.5 ? "These seem to be two places: the maps overlap by less than half." :
      "These are two maps; if they do not show one place in one frame, they are two places.";
    return `${first} Each list is of its own map, and its positions are in that map's own frame.`;
  }

  goalItem(k, goal, i) {
    const place = this.toLevel(k, goal.position);
    const button = made("button", { type: "button" },
      made("span", {}, made("span", { className: "number", textContent: i + 1 }), placeText(goal.position)),
      made("small", { textContent: `probability ${goal.probability.toFixed(2)}` }));
    button.addEventListener("click", () => this.viewer.flyTo(place));
    const parts = made("div", { className: "parts" });
    for (const [name, heat] of Object.entries(goal.parts)) {
      parts.append(made("span", { textContent: name.replace("_", " ") }),
        made("meter", { min: 0, max: 1, value: heat, ariaLabel: name }), made("span", { textContent: heat.toFixed(2) }));
    }
    return made("li", {}, button, parts);
  }

  // ---- what is shown ----

  bindLook() {
    for (const id of ["high", "low"]) $(id).addEventListener("input", () => this.cut());
    this.limits();
    this.bindStoreys();
    $("colour").addEventListener("change", () => this.colourBy($("colour").value));
    for (const kind of ["things", "boxes", "sounds", "sources", "rooms", "path"]) {
      $(`show-${kind}`).addEventListener("change", () => {
        this.marks();
        this.legend();
        this.drawPath();
      });
    }
    $("arrangement-field").hidden = this.maps.length < 2;
    $("arrangement").addEventListener("change", () => {
      this.viewer.arrangement = $("arrangement").value;
      $("divider").hidden = $("seam").hidden = $("arrangement").value !== "divided";
      this.viewer.moved();
    });
    $("divide").addEventListener("input", () => {
      this.viewer.divide = Number($("divide").value);
      $("seam").style.left = `${100 * this.viewer.divide}%`;
      this.viewer.changed();
    });
  }

  /** Between which heights the map may be cut; where a person has cut it, it stays as it is. */
  limits() {
    const low = Math.min(...this.maps.map((map) => map.low[2]));
    const high = Math.max(...this.maps.map((map) => map.high[2]));
    const ceiling = Math.max(...this.maps.map((map) => map.ceiling_m));
    this.viewer.look.heights = [Math.min(...this.maps.map((map) => map.floor_m)), Math.max(high, low + 0.5)];
    const kept = this.isCut ? { high: $("high").value, low: $("low").value } : {};
    const range = { min: low - 0.1, max: high + 0.1, step: 0.05 };
    Object.assign($("high"), range, { value: Math.min(ceiling, high + 0.1) });
    Object.assign($("low"), range, { value: low - 0.1 });
    this.uncut = [Number($("low").value), Number($("high").value)];
    for (const [id, value] of Object.entries(kept)) $(id).value = value;
    this.cut();
  }

  /** One storey is shown by cutting away the others, and its own ceiling. */
  bindStoreys() {
    const storeys = this.maps.find((map) => map.storeys)?.storeys ?? [];
    $("storey-field").hidden = !storeys.length;
    for (const [k, { name, floor_m }] of [...storeys.entries()].reverse()) {
      $("storey").append(made("option", { value: `${k}`, textContent: `${name}, ${metres(floor_m)}` }));
    }
    $("storey").addEventListener("change", () => {
      const chosen = storeys[$("storey").value]?.cut ?? this.uncut;
      [$("low").value, $("high").value] = chosen;
      this.cut();
    });
  }

  /** Height of the floor under a place of a map. */
  floorUnder(map, z) {
    const below = (map.storeys ?? []).filter((storey) => storey.low_m <= z);
    return (below.at(-1) ?? map).floor_m;
  }

  cut() {
    const [low, high] = [Number($("low").value), Number($("high").value)];
    $("low-m").textContent = metres(low);
    $("high-m").textContent = metres(high);
    this.isCut = [low, high].some((value, k) => value !== this.uncut?.[k]);
    const all = Number($("high").value) >= Number($("high").max) - 1e-6;
    this.keep();
    this.viewer.look.cut = [low, all ? 1e9 : high];
    if (low <= Number($("low").min) + 1e-6) this.viewer.look.cut[0] = -1e9;
    this.viewer.changed();
  }

  colourBy(name) {
    $("colour").value = name;
    this.viewer.look.colour = name;
    $("overlay").classList.toggle("hot", name === "heat");
    this.legend();
    this.keep();
    this.viewer.changed();
  }

  legend() {
    const list = $("legend");
    list.replaceChildren();
    const name = this.viewer.look.colour;
    const palettes = this.contents[0]?.palettes ?? this.told.palettes;
    const shade = (kind, k) => `rgb(${palettes[kind].slice(3 * k, 3 * k + 3).join(",")})`;
    if (name === "height" || name === "heat") {
      const canvas = made("canvas", { width: 256, height: 1 });
      const pen = canvas.getContext("2d");
      for (let k = 0; k < 256; k++) {
        pen.fillStyle = "#aaa";
        pen.fillRect(k, 0, 1, 1);
        const share = Math.min(1, Math.max(0, (k / 255 - FAINT) / (GLOWING - FAINT)));
        pen.globalAlpha = name === "heat" ? share * share * (3 - 2 * share) : 1; // as the shader mixes
        pen.fillStyle = shade(name, k);
        pen.fillRect(k, 0, 1, 1);
        pen.globalAlpha = 1;
      }
      const [low, high] = this.viewer.look.heights;
      const ends = name === "heat" ? ["0", this.viewer.look.hottest.toFixed(2)] : [metres(low), metres(high)];
      list.append(made("li", { className: "ramp" }, ends[0], canvas, ends[1]));
    } else if (name === "thing" || name === "room") {
      const names = this.contents[0]?.[name === "thing" ? "names" : "room_names"];
      if (!names) list.append(made("li", { textContent: "The map's contents are still being computed." }));
      (names ?? []).forEach((text, k) => {
        const tint = made("i");
        tint.style.background = shade(name, k + 1);
        list.append(made("li", {}, tint, text));
      });
    }
    if (!$("show-sources").checked || !this.contents.some((one) => one?.sources.length)) return;
    for (const [share, tint] of Object.entries(SOURCE_TINTS)) {
      const edge = made("i");
      edge.style.background = `rgb(${tint.map((value) => Math.round(255 * value)).join(",")})`;
      list.append(made("li", { className: "source" }, edge, `a sound's source, with ${percent(Number(share))}`));
    }
  }

  /** All names and numbers over the picture. */
  marks() {
    this.viewer.fields.forEach(({ marks, map }, k) => {
      const contents = this.contents[k];
      const shown = (kind) => contents && $(`show-${kind}`).checked;
      const answer = this.answers?.[k];
      marks.set("goal", 0, (answer?.goals ?? []).map((goal, i) => ({
        place: this.toLevel(k, goal.position), text: String(i + 1), always: true,
        title: `goal ${i + 1}, probability ${goal.probability.toFixed(2)}: ` +
          Object.entries(goal.parts).map(([name, heat]) => `${name} ${heat.toFixed(2)}`).join(", "),
        onClick: () => this.viewer.flyTo(this.toLevel(k, goal.position)),
      })));
      for (const { element } of marks.kinds.get("goal").marks) element.classList.toggle("guess", !answer?.found);
      marks.set("sound", 2, shown("sounds") ? contents.sounds.map((sound, i) => ({
        place: this.toLevel(k, sound.position), text: `♪ ${sound.names[0] ?? `sound ${i + 1}`}`,
        title: `play what was heard at ${clock(sound.onset_s)}`, onClick: (event) => this.play(k, i, event.target),
      })) : []);
      this.markSources(k, shown("sources") ? contents.sources : []);
      marks.set("room", 3, shown("rooms") ? contents.rooms.map((room) => {
        const place = this.toLevel(k, room.position);
        const floor = room.outline.length ? this.toLevel(k, room.outline[0])[2] : this.floorUnder(map, place[2]);
        const onFloor = [place[0], place[1], floor + 0.02];
        return { place: onFloor, text: room.room, title: `go to the ${room.room}${areaText(room)}`,
          onClick: () => this.viewer.flyTo(onFloor, 6) };
      }) : []);
      const outlined = shown("rooms") ? contents.rooms.filter((room) => room.outline.length) : [];
      this.viewer.setLines(k, "rooms", outlined.map((room) => {
        const corners = [...room.outline, room.outline[0]].map((corner) => add(this.toLevel(k, corner), [0, 0, 0.03]));
        const tint = contents.palettes.room.slice(3 * room.label, 3 * room.label + 3).map((value) => value / 255);
        return { kind: "band", places: band(corners, 0.08), tint };
      }));
      marks.set("thing", 4, shown("things") ? contents.things.map((thing) => {
        const [r, g, b] = contents.palettes.thing.slice(3 * thing.label, 3 * thing.label + 3);
        return {
          place: this.toLevel(k, thing.position), text: thing.name, tint: `rgb(${r},${g},${b})`,
          title: `${thing.name}, confidence ${thing.confidence.toFixed(2)}`,
          onClick: () => this.viewer.flyTo(this.toLevel(k, thing.position)),
        };
      }) : []);
      this.viewer.setLines(k, "boxes", $("show-boxes").checked && contents ? contents.things.map((thing) => ({
        kind: "line", places: boxEdges(thing.low, thing.high),
        tint: contents.palettes.thing.slice(3 * thing.label, 3 * thing.label + 3).map((value) => value / 255),
      })) : null);
      this.viewer.setLines(k, "goals", answer ? answer.goals.map((goal) => {
        const place = this.toLevel(k, goal.position);
        const foot = [place[0], place[1], this.floorUnder(map, place[2])];
        return { kind: "line", tint: INK_TINT, places: new Float32Array([...place, ...foot]) };
      }) : null);
    });
    this.viewer.changed();
  }

  /** The regions that hold the sources of sounds, and from where the robot heard the chosen one. */
  markSources(k, sources) {
    const { marks, map } = this.viewer.fields[k];
    marks.set("source", 1.5, sources.map((source, i) => ({
      place: this.toLevel(k, source.position), text: `◉ ${source.name || `source ${i + 1}`}`,
      title: `${sourceText(source)}; play it, and show from where it was heard`,
      onClick: (event) => {
        this.showRays(k, source);
        this.play(k, source.sounds[0], event.target);
      },
    })));
    this.viewer.setLines(k, "sources", sources.flatMap(({ regions, position }) => {
      const floor = this.floorUnder(map, this.toLevel(k, position)[2]) + 0.04;
      return regions.flatMap(({ probability, outlines }) => outlines.map((corners) => ({
        kind: "band", tint: SOURCE_TINTS[probability], through: true,
        places: band([...corners, corners[0]].map(([x, y]) => [x, y, floor]), probability > 0.5 ? 0.04 : 0.08),
      })));
    }));
    if (this.heard?.k === k && !sources.includes(this.heard.source)) this.viewer.setLines(k, "rays", null);
  }

  /** Lines from the places where the robot heard a source to the source. */
  showRays(k, source) {
    this.heard = { k, source };
    const end = this.toLevel(k, source.position);
    const places = source.sounds.flatMap((number) => {
      const { track } = this.contents[k].sounds[number];
      const step = Math.max(1, Math.ceil(track.length / RAYS));
      return track.filter((_, i) => i % step === 0);
    });
    const rays = places.map((place) => ({ kind: "band", tint: SOURCE_TINTS[0.9], through: true,
      places: band([place, end], 0.025) }));
    this.viewer.fields.forEach((_, other) => this.viewer.setLines(other, "rays", other === k ? rays : null));
  }

  list() {
    const { things, sounds, sources, rooms } = this.contents[0];
    const { palettes } = this.contents[0];
    const row = (text, more, place, distance, [kind, label] = []) => {
      const swatch = kind ? [made("i", { className: "swatch" })] : [];
      if (kind) swatch[0].style.background = `rgb(${palettes[kind].slice(3 * label, 3 * label + 3).join(",")})`;
      const button = made("button", { type: "button" }, made("span", { className: "named" }, ...swatch, text),
        made("small", { textContent: more }));
      button.addEventListener("click", () => this.viewer.flyTo(this.toLevel(0, place), distance));
      return made("li", {}, button);
    };
    $("things").replaceChildren(...things.map((thing) =>
      row(thing.name, `${percent(thing.confidence)} · ${thing.size.map((side) => side.toFixed(1)).join(" × ")} m`,
        thing.position, 3, ["thing", thing.label])));
    $("sounds").replaceChildren(...sounds.map((sound, i) => {
      const item = row(sound.names[0] ?? `sound ${i + 1}`,
        `${clock(sound.onset_s)}, ${(sound.offset_s - sound.onset_s).toFixed(1)} s` +
          (sound.confidences.length ? ` · ${percent(sound.confidences[0])}` : ""), sound.position, 5);
      item.append(made("audio", { controls: true, preload: "none", src: this.source.clip(0, i),
        ariaLabel: `clip of ${sound.names[0] ?? "the sound"}` }));
      return item;
    }));
    $("sources").replaceChildren(...sources.map((source, i) => {
      const item = row(source.name || `source ${i + 1}`, sourceText(source), source.position, 5);
      item.firstChild.addEventListener("click", () => this.showRays(0, source));
      item.append(made("audio", { controls: true, preload: "none", src: this.source.clip(0, source.sounds[0]),
        ariaLabel: `clip of ${source.name || "the source"}` }));
      return item;
    }));
    $("sources-section").hidden = $("sources-field").hidden = !this.contents.some((one) => one?.sources.length);
    $("rooms").replaceChildren(...rooms.map((room) =>
      row(room.room, `${percent(room.probability)}${areaText(room)} · ${room.views} views`, room.position, 7,
        ["room", room.label])));
    for (const [id, list] of [["things", things], ["sounds", sounds], ["sources", sources], ["rooms", rooms]]) {
      $(`${id}-count`).textContent = `(${list.length})`;
    }
    if (!this.source.live) return;
    $("questions").replaceChildren();
    const examples = [...new Set(things.map((thing) => thing.name))].slice(0, 3).map((name) => `the ${name}`);
    const [sound] = sounds.filter((one) => one.names.length);
    if (sound) examples.push(`the sound of ${sound.names[0]}`);
    for (const example of examples) this.offer(example);
  }

  play(k, i, mark) {
    this.audio?.pause();
    document.querySelector(".mark.playing")?.classList.remove("playing");
    if (this.playing === mark) {
      this.playing = null;
      return;
    }
    this.playing = mark;
    mark.classList.add("playing");
    this.audio = new Audio(this.source.clip(k, i));
    this.audio.addEventListener("ended", () => {
      mark.classList.remove("playing");
      this.playing = null;
    });
    this.audio.play().catch((fault) => this.note(`The clip cannot be played: ${fault.message}`));
  }

  // ---- a click ----

  async clicked(hit) {
    if ($("measure").getAttribute("aria-pressed") === "true") {
      this.measureTo(hit);
      return;
    }
    const { layer, map } = this.viewer.fields[hit.k];
    const middle = layer.middle(hit.number);
    const half = Array(3).fill(0.55 * map.voxel_size_m);
    this.viewer.fields.forEach((_, k) => this.viewer.setLines(k, "voxel", k === hit.k ? [
      { kind: "line", places: boxEdges(sub(middle, half), add(middle, half)), tint: [1, 0.69, 0], through: true },
    ] : null));
    try {
      this.showVoxel(hit.k, (await this.source.voxel(hit.k, hit.number)) ?? this.keptVoxel(hit));
    } catch (fault) {
      $("voxel").replaceChildren(made("p", { className: "verdict fault", textContent: fault.message }));
    }
  }

  /** What a page without a server knows of a voxel. */
  keptVoxel({ k, number }) {
    const { layer, map } = this.viewer.fields[k];
    const contents = this.contents[k];
    const [thing, , name, confidence] = layer.labels?.subarray(4 * number, 4 * number + 4) ?? [0, 0, 0, 0];
    const seen = new Uint16Array(layer.records.buffer, number * map.record_bytes, 4)[3];
    const recordingFromLevel = invertedPose(fromRows(map.level_from_recording));
    return {
      position: moved(recordingFromLevel, layer.middle(number)),
      names: name ? [{ name: contents.voxel_names[name - 1], confidence: confidence / 255 }] : [],
      calibrated: true, thing: thing ? { name: contents.names[thing - 1] } : null,
      last_seen_s: (seen / 65535) * map.duration_s,
    };
  }

  showVoxel(k, voxel) {
    const rows = voxel.names.map(({ name, confidence }) => made("tr", {}, made("td", { textContent: name }),
      made("td", { textContent: voxel.calibrated ? percent(confidence) : `similarity ${confidence.toFixed(2)}` })));
    const thing = voxel.thing ? `Part of: ${voxel.thing.name}. ` : "";
    const seen = `Last seen at ${clock(voxel.last_seen_s)}` + (voxel.views === undefined ? "." :
      `; ${voxel.views} keyframe${voxel.views === 1 ? "" : "s"} saw it (${voxel.pixels.toLocaleString("en")} pixels).`);
    $("voxel").replaceChildren(
      made("p", {}, rows.length ? "Taken for:" : voxel.note || "The map has no name for it."),
      made("table", {}, made("tbody", {}, ...rows)),
      made("p", { className: "soft", textContent: `${thing}${seen} At ${placeText(voxel.position)}.` }));
    if (this.source.live && voxel.thing) $("voxel").append(this.renaming(k, voxel.thing.name, voxel.position));
    if (!voxel.seen_by?.length) return;
    const button = made("button", { type: "button", textContent: "Show the nearest view" });
    button.addEventListener("click", () => this.showMoment(k, voxel.seen_by[0], true));
    $("voxel").append(button);
  }

  /** Ask a person for the right name of a thing. */
  renaming(k, thing, place) {
    const to = made("input", { type: "text", maxLength: 80, required: true, placeholder: "another name" });
    to.setAttribute("aria-label", `another name for the ${thing}`);
    const form = made("form", { id: "rename" }, to, made("button", { type: "submit", textContent: "Rename" }));
    const told = made("p", { className: "soft" });
    form.append(told);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      try {
        const { text } = await this.source.rename(k, thing, place, to.value);
        form.replaceWith(made("p", { id: "renamed", textContent: text }));
      } catch (fault) {
        told.textContent = fault.message;
      }
    });
    return form;
  }

  bindTools() {
    $("whole").addEventListener("click", () => this.viewer.frameAll());
    $("above").addEventListener("click", () => this.viewer.frameAll(true));
    $("save").addEventListener("click", () => this.save().catch((fault) => this.note(fault.message)));
    const press = (on) => {
      $("measure").setAttribute("aria-pressed", String(on));
      $("canvas").classList.toggle("measuring", on);
      this.tape = [];
      this.showTape();
    };
    $("measure").addEventListener("click", () => press($("measure").getAttribute("aria-pressed") !== "true"));
    document.addEventListener("keydown", (event) => event.key === "Escape" && press(false));
  }

  measureTo(hit) {
    const end = { k: hit.k, place: hit.place };
    this.tape = this.tape.length === 1 && this.tape[0].k === hit.k ? [this.tape[0], end] : [end];
    this.showTape();
  }

  showTape() {
    const [from, to] = this.tape;
    const along = to && sub(to.place, from.place);
    const text = along ? `${metres(length(along))}; level ${metres(Math.hypot(along[0], along[1]))}, ` +
      `up ${metres(along[2])}` : "";
    const pressed = $("measure").getAttribute("aria-pressed") === "true";
    $("length").textContent = text || (pressed ? (from ? `${CLICK} the other end.` : `${CLICK} one end.`) : "");
    this.viewer.fields.forEach(({ marks }, k) => {
      const mine = from?.k === k ? this.tape : [];
      marks.set("tape", 1, mine.map(({ place }, i) => ({ place, text: i ? metres(length(along)) : "•", always: true })));
      this.viewer.setLines(k, "tape", mine.length === 2 ? [{ kind: "line", tint: [1, 0.5, 0], through: true,
        places: new Float32Array([...from.place, ...to.place]) }] : null);
    });
  }

  // ---- the walk ----

  bindPath() {
    const { keyframes } = this.maps[0];
    $("path-section").hidden = !keyframes.length;
    $("moment").max = Math.max(0, keyframes.length - 1);
    $("moment").addEventListener("input", () => this.showMoment(0, Number($("moment").value)));
    $("stand").addEventListener("click", () => {
      this.viewer.flight = null;
      this.viewer.camera.standAt(this.maps[0].keyframes[this.moment ?? 0]);
      this.viewer.moved();
    });
    $("path-section").addEventListener("toggle", () => {
      if ($("path-section").open) this.showMoment(0, this.moment ?? 0);
      else this.viewer.setLines(0, "camera", null);
    });
  }

  showMoment(k, asked, open = false) {
    const number = this.source.nearestKeyframe(k, asked);
    const frame = this.maps[k].keyframes[number];
    if (k === 0) {
      this.moment = number;
      if (!open) this.source.live || ($("moment").value = number);
      else $("moment").value = number;
    }
    if (open) $("path-section").open = true;
    $("frame").src = this.source.keyframe(k, number);
    $("frame").alt = `what the camera saw at ${clock(frame.stamp_s)}`;
    $("frame-time").textContent = `${clock(frame.stamp_s)}, view ${number + 1} of ${this.maps[k].keyframes.length}`;
    $("moment").setAttribute("aria-valuetext", clock(frame.stamp_s));
    this.viewer.setLines(k, "camera", [{ kind: "line", tint: [0.85, 0.1, 0.35], through: true,
      places: cameraEdges(frame, this.maps[k].field_of_view) }]);
  }

  drawPath() {
    this.maps.forEach((map, k) => {
      const carriedAt = ({ position: [, , z] }) => z - this.floorUnder(map, map.storeys ? z - 0.3 : z);
      const heights = map.keyframes.map(carriedAt).sort((a, b) => a - b);
      const carried = heights.length ? heights[heights.length >> 1] - 0.04 : 0;
      const places = map.keyframes.map(({ position: [x, y, z] }) => [x, y, z - carried]);
      this.viewer.setLines(k, "path", $("show-path").checked && places.length > 1 ?
        [{ kind: "band", places: band(places, 0.045), tint: PATH_TINT }] : null);
    });
  }

  // ---- driving ----

  bindDrive() {
    $("robot").textContent = this.told.robot ? "The simulated robot stands where the last command left it." :
      "There is no scene, so that commands are planned on the map and nothing drives (--scene).";
    $("go").addEventListener("submit", (event) => {
      event.preventDefault();
      this.go($("command").value);
    });
    $("at").addEventListener("input", () => this.stepTo(Number($("at").value)));
    $("step").addEventListener("click", () => this.stepTo(Math.min(Number($("at").value) + 1, Number($("at").max))));
    $("play").addEventListener("click", () => (this.ticking ? this.halt() : this.run()));
  }

  async go(command) {
    const button = $("go").querySelector(".main");
    button.disabled = true;
    this.halt();
    $("trip").replaceChildren(made("p", { textContent: "Planning." }));
    try {
      this.showTrip(await this.source.go({ command, ...this.files }));
    } catch (fault) {
      $("trip").replaceChildren(made("p", { className: "verdict fault", textContent: fault.message }));
      $("steps").hidden = true;
    } finally {
      button.disabled = false;
    }
  }

  showTrip({ plan, program, readings, notes, planned, driven }) {
    const done = driven ?? planned;
    const said = done.error ?? (done.ok ? "" : done.subgoals.filter((goal) => !goal.reached).map((goal) =>
      `${goal.name || goal.skill} was not reached${goal.note ? `: ${goal.note}` : ""}`).join("; "));
    const verb = driven ? "driven" : "planned";
    $("trip").replaceChildren(
      made("p", { textContent: plan || "The command is understood." }),
      made("pre", { textContent: program }),
      made("p", { className: `verdict ${done.ok ? "found" : "lost"}`,
        textContent: (done.ok ? "Done: " : "Not done: ") + `${done.path_m.toFixed(1)} m ${verb}, ` +
          `${done.actions.length} actions. ${said ?? ""}` }),
      ...[...new Set([...notes, ...done.notes])].map((note) => made("p", { className: "soft", textContent: note })),
      made("details", {}, made("summary", { textContent: "Readings" }), made("pre", { textContent: readings.join("\n") })));
    const lift = (places) => places.map(([x, y, z]) => [x, y, z + 0.06]);
    const bands = [{ kind: "band", places: band(lift(planned.places), 0.1), tint: [0.42, 0.25, 0.72] }];
    if (driven) bands.push({ kind: "band", places: band(lift(lift(driven.places)), 0.05), tint: [1, 0.69, 0] });
    this.viewer.setLines(0, "trip", bands.filter(({ places }) => places.length > 6));
    this.trip = done.places;
    $("steps").hidden = !this.trip.length;
    $("at").max = Math.max(0, this.trip.length - 1);
    this.stepTo(0);
    if (this.trip.length > 1) this.run();
  }

  stepTo(at) {
    $("at").value = at;
    const place = this.trip[at];
    if (!place) return;
    $("at-text").textContent = `step ${at} of ${this.trip.length - 1}, at ${placeText(place)}`;
    this.viewer.fields[0].marks.set("robot", 1, [{ place: add(place, [0, 0, 0.2]), text: "●", always: true }]);
    this.viewer.changed();
  }

  run() {
    if (Number($("at").value) >= Number($("at").max)) this.stepTo(0);
    $("play").textContent = "Pause";
    this.ticking = setInterval(() => {
      this.stepTo(Number($("at").value) + 1);
      if (Number($("at").value) >= Number($("at").max)) this.halt();
    }, 100);
  }

  halt() {
    clearInterval(this.ticking);
    this.ticking = null;
    $("play").textContent = "Play";
  }
}

(async () => {
  const told = JSON.parse($("told").textContent);
  const source = told ? new PageSource(told) : new LiveSource();
  try {
    const panel = new Panel(source, await source.describe());
    window.avlmapsView = panel; // for tests and for the curious
    await panel.start();
  } catch (fault) {
    $("loading").classList.add("fault");
    $("loading").textContent = fault.message;
  }
})();
