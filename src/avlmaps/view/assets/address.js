// The view and the question in the page's address, after the #: a reload, a bookmark or a link brings them back.

const Address = {
  /** What the address says; numbers that are none are left out. */
  read() {
    const words = new URLSearchParams(location.hash.slice(1));
    const numbers = (name) => (words.get(name) ?? "").split(",").filter(Boolean).map(Number);
    return { question: words.get("q") ?? "", view: numbers("view"), colour: words.get("colour") ?? "", cut: numbers("cut") };
  },

  /** Put a state there, without a new entry in the history. */
  write({ question, view, colour, cut }) {
    const words = new URLSearchParams();
    if (question) words.set("q", question);
    if (colour && colour !== "picture") words.set("colour", colour);
    words.set("view", view.join(","));
    if (cut.length) words.set("cut", cut.join(","));
    const hash = `#${words.toString().replaceAll("%2C", ",")}`;
    if (hash === location.hash) return;
    try {
      history.replaceState(null, "", hash);
      this.own = hash;
    } catch {
      // A browser that limits how often an address changes keeps the one before.
    }
  },
};
