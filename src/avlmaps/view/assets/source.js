// Where the page has its map from: a server, or the page itself. Both offer the same.

const WATCH_MS = 3000;

async function answeredJson(response) {
  const told = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(told.error?.message ?? `The viewer answered ${response.status}.`);
  return told;
}

class LiveSource {
  live = true;

  /** The page is /maps/NAME/view; ?other= names a second map, to compare. */
  constructor() {
    const own = location.pathname.replace(/\/view$/, "");
    const other = new URLSearchParams(location.search).get("other");
    this.at = other === null ? [own] : [own, own.replace(/[^/]*$/, encodeURIComponent(other))];
  }

  async describe() {
    const told = await Promise.all(this.at.map((at) => fetch(`${at}/view/map`).then(answeredJson)));
    this.versions = told.map(({ version }) => version);
    return { ...told[0], maps: told.map(({ map }) => map) };
  }

  /** Call `changed` whenever a map has another content: it grew, was built again, or was edited. */
  watch(changed) {
    const list = this.at[0].replace(/\/[^/]*$/, "");
    const names = this.at.map((at) => decodeURIComponent(at.replace(/^.*\//, "")));
    let seen = null;
    const look = async () => {
      const told = document.hidden ? null : await fetch(list).then(answeredJson).catch(() => null);
      const now = told && names.map((name) => told.maps.find((one) => one.name === name)?.version).join(" ");
      if (now && seen !== null && now !== seen && !(await changed().then(() => true, () => false))) return;
      seen = now ?? seen;
    };
    look();
    setInterval(look, WATCH_MS);
  }

  /** Read voxels as they come; `onPart(bytes, start)` gets them piece by piece. */
  async voxels(map, onPart) {
    const response = await fetch(`${this.at[map]}/view/voxels`);
    if (!response.ok) await answeredJson(response);
    const reader = response.body.getReader();
    for (let at = 0; ; ) {
      const { done, value } = await reader.read();
      if (done) return;
      onPart(value, at);
      at += value.length;
    }
  }

  contents(map) {
    return fetch(`${this.at[map]}/view/contents`).then(answeredJson);
  }

  async labels(map) {
    const response = await fetch(`${this.at[map]}/view/labels`);
    if (!response.ok) await answeredJson(response);
    return new Uint8Array(await response.arrayBuffer());
  }

  voxel(map, number) {
    return fetch(`${this.at[map]}/view/voxels/${number}`).then(answeredJson);
  }

  /** Give the thing at a place another name; the answer's text says so. */
  rename(map, thing, place, to) {
    const at = place.map((value) => value.toFixed(3)).join(",");
    return posted(`${this.at[map]}/edit`, { does: "rename", name: thing, at, to }).then(answeredJson);
  }

  keyframe(map, number) {
    return `${this.at[map]}/keyframes/${number}`;
  }

  nearestKeyframe(map, number) {
    return number;
  }

  clip(map, number) {
    return `${this.at[map]}/sounds/${number}/clip`;
  }

  /** Return a file as it is sent: the server reads PNG and JPEG, the browser more. */
  async taken(kind, file) {
    if (kind !== "photo") return file;
    const picture = await createImageBitmap(file).catch(() => null);
    if (!picture) throw new Error(`${file.name} cannot be read as an image; choose another file.`);
    if (["image/jpeg", "image/png"].includes(file.type)) return file;
    const sheet = made("canvas", { width: picture.width, height: picture.height });
    sheet.getContext("2d").drawImage(picture, 0, 0);
    const png = await new Promise((resolve) => sheet.toBlob(resolve, "image/png"));
    return new File([png], file.name, { type: "image/png" });
  }

  /** Ask each map; the heat of one comes after that of the other. */
  async ask(words) {
    const told = await Promise.all(this.at.map((at, map) => this.askOne(at, map, words)));
    const heat = new Uint8Array(told.reduce((sum, one) => sum + one.heat.length, 0));
    let at = 0;
    for (const one of told) {
      heat.set(one.heat, at);
      at += one.heat.length;
    }
    return { answers: told.map(({ answer }) => answer), heat };
  }

  async askOne(at, map, words) {
    const response = await posted(`${at}/view/ask`, { ...words, top: 5 });
    if (!response.ok) await answeredJson(response);
    const bytes = new Uint8Array(await response.arrayBuffer());
    const size = new DataView(bytes.buffer).getUint32(0, true);
    const told = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
    if (told.version !== this.versions[map]) throw new Error("The map has grown; ask again.");
    return { answer: told.answer, heat: bytes.subarray(4 + size) };
  }

  /** Plan a command; without a robot of its own the server begins where the last one ended. */
  async go(words) {
    const start = this.pose ? { start: this.pose.map((value) => value.toFixed(6)).join(",") } : {};
    const told = await posted(`${this.at[0]}/view/rehearse`, { ...words, ...start }).then(answeredJson);
    this.pose = told.pose;
    return told;
  }
}

/** Send words and files as a form. */
function posted(path, words) {
  const form = new FormData();
  for (const [name, value] of Object.entries(words)) form.append(name, value);
  return fetch(path, { method: "POST", body: form });
}

function fromBase64(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function unpacked(text) {
  const stream = new Blob([fromBase64(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A map inside the page: what was asked when the page was written can be asked, and nothing else. */
class PageSource {
  live = false;

  constructor(told) {
    this.told = told;
    this.clips = new Map();
  }

  async describe() {
    return this.told;
  }

  async voxels(map, onPart) {
    onPart(await unpacked(this.told.records[map]), 0);
  }

  async contents(map) {
    return this.told.contents[map];
  }

  labels(map) {
    return unpacked(this.told.labels[map]);
  }

  async voxel() {
    return null;
  }

  keyframe(map, number) {
    return `data:image/jpeg;base64,${this.told.pictures[map][this.nearestKeyframe(map, number)]}`;
  }

  /** Of the keyframes whose pictures are in the page, the one nearest in time. */
  nearestKeyframe(map, number) {
    const kept = Object.keys(this.told.pictures[map]).map(Number);
    return kept.reduce((best, one) => (Math.abs(one - number) < Math.abs(best - number) ? one : best), kept[0]);
  }

  clip(map, number) {
    const key = `${map}/${number}`;
    if (!this.clips.has(key)) {
      const sound = new Blob([fromBase64(this.told.clips[map][number])], { type: "audio/flac" });
      this.clips.set(key, URL.createObjectURL(sound));
    }
    return this.clips.get(key);
  }

  async ask({ sentence }) {
    const kept = this.told.questions.find((one) => one.question === sentence);
    if (!kept) throw new Error("This page answers the questions listed; others need avlmaps view MAP.");
    return { ...kept, heat: await unpacked(kept.heat) };
  }
}
