// Names, numbers and signs over the picture. They repeat what the panel lists, so that screen readers pass over them.

class Marks {
  constructor(box) {
    this.box = box;
    this.kinds = new Map();
  }

  /** Replace the marks of a kind; `rank` says which stays where two would cover one another (the least). */
  set(kind, rank, marks) {
    for (const mark of this.kinds.get(kind)?.marks ?? []) mark.element.remove();
    const made = [];
    for (const mark of marks) {
      const element = document.createElement(mark.onClick ? "button" : "span");
      element.className = `mark ${kind}`;
      element.textContent = mark.text;
      element.tabIndex = -1;
      element.style.zIndex = String(Math.round(1000 * (9 - rank)) - made.length); // the first one lies on top
      if (mark.title) element.title = mark.title;
      if (mark.tint) element.style.setProperty("--tint", mark.tint);
      if (mark.onClick) element.addEventListener("click", mark.onClick);
      this.box.append(element);
      made.push({ ...mark, element, size: null });
    }
    this.kinds.set(kind, { rank, marks: made });
  }

  /** Put each mark where its place is seen, and hide what another one covers. */
  update(camera, box, cut) {
    Object.assign(this.box.style, { left: `${box.left}px`, top: `${box.top}px`, width: `${box.width}px`,
      height: `${box.height}px` });
    const taken = [];
    const kinds = [...this.kinds.values()].sort((a, b) => a.rank - b.rank);
    for (const { marks } of kinds) {
      for (const mark of marks) {
        const [x, y, , w] = transformed(camera.clipFromLevel, mark.place);
        const at = [box.x + (0.5 + (0.5 * x) / w) * box.seenWidth, box.y + (0.5 - (0.5 * y) / w) * box.seenHeight];
        const inside = w > 0.1 && at[0] > 0 && at[1] > 0 && at[0] < box.width && at[1] < box.height;
        mark.size ??= [mark.element.offsetWidth, mark.element.offsetHeight];
        const [left, top] = [at[0] - mark.size[0] / 2, at[1] - mark.size[1] / 2];
        const cover = [left - 2, top - 1, left + mark.size[0] + 2, top + mark.size[1] + 1];
        const meets = (other) => cover[0] < other[2] && cover[2] > other[0] && cover[1] < other[3] && cover[3] > other[1];
        const high = mark.place[2] > cut[1] + 0.3 || mark.place[2] < cut[0] - 0.3;
        const shown = inside && (mark.always || !(high || taken.some(meets)));
        mark.element.style.visibility = shown ? "visible" : "hidden";
        if (!shown) continue;
        taken.push(cover);
        mark.element.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
      }
    }
  }
}
