// Where the page has its map from: a server, or the page itself. Both offer the same.

async function answeredJson(response) {
  const told = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(told.error?.message ?? `The viewer answered ${response.status}.`);
  return told;
}

class LiveSource {
  live = true;

  describe() {
    return fetch("/api/maps").then(answeredJson);
  }

  /** Read voxels as they come; `onPart(bytes, start)` gets them piece by piece. */
  async voxels(map, onPart) {
    const response = await fetch(`/api/maps/${map}/voxels`);
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
    return fetch(`/api/maps/${map}/contents`).then(answeredJson);
  }

  async labels(map) {
    const response = await fetch(`/api/maps/${map}/labels`);
    if (!response.ok) await answeredJson(response);
    return new Uint8Array(await response.arrayBuffer());
  }

  voxel(map, number) {
    return fetch(`/api/maps/${map}/voxels/${number}`).then(answeredJson);
  }

  keyframe(map, number) {
    return `/api/maps/${map}/keyframes/${number}`;
  }

  nearestKeyframe(map, number) {
    return number;
  }

  clip(map, number) {
    return `/api/maps/${map}/clips/${number}`;
  }

  async upload(kind, file) {
    const headers = { "Content-Type": "application/octet-stream", "X-Name": encodeURIComponent(file.name) };
    return (await fetch(`/api/uploads/${kind}`, { method: "POST", headers, body: file }).then(answeredJson)).upload;
  }

  async ask(words) {
    const response = await posted("/api/ask", words);
    if (!response.ok) await answeredJson(response);
    const bytes = new Uint8Array(await response.arrayBuffer());
    const size = new DataView(bytes.buffer).getUint32(0, true);
    const told = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + size)));
    return { ...told, heat: bytes.subarray(4 + size) };
  }

  go(words) {
    return posted("/api/go", words).then(answeredJson);
  }
}

function posted(path, words) {
  const headers = { "Content-Type": "application/json" };
  return fetch(path, { method: "POST", headers, body: JSON.stringify(words) });
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
